#include "world/broad_phase.h"

#include <box2d/b2_body.h>
#include <box2d/b2_fixture.h>

#include <cstddef>
#include <vector>

#include "world/box2d_members.h"

namespace flatland {
namespace {

using members::BroadPhaseMoved;
using members::BroadPhaseMovedCount;
using members::BroadPhaseTree;
using members::get;

// Returns whether there is a box of a dynamic fixture that overlaps the box of a proxy, by proxy.
std::vector<bool> find_near_dynamic(const b2World& world) {
  const b2BroadPhase& broad_phase = broad_phase_of(world);
  struct Marks {
    std::vector<bool> near;
    bool QueryCallback(int32 proxy) {
      const auto index = static_cast<std::size_t>(proxy);
      if (index >= near.size()) near.resize(index + 1);
      near[index] = true;
      return true;
    }
  } marks;
  for (const b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (body->GetType() != b2_dynamicBody) continue;
    for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
      const b2FixtureProxy* proxies = get<members::FixtureProxies>(*f);
      for (int32 i = 0; i < get<members::FixtureProxyCount>(*f); ++i) {
        broad_phase.Query(&marks, broad_phase.GetFatAABB(proxies[i].proxyId));
      }
    }
  }
  return marks.near;
}

}  // namespace

b2BroadPhase& broad_phase_of(const b2World& world) {
  return const_cast<b2BroadPhase&>(world.GetContactManager().m_broadPhase);
}

int32 pending_fixtures(const b2World& world) {
  return get<BroadPhaseMovedCount>(broad_phase_of(world));
}

void find_new_pairs(b2World& world) {
  constexpr int32 kFew = 64;  // pending fixtures whose search is short
  b2BroadPhase& broad_phase = broad_phase_of(world);
  std::vector<int32> withdrawn;
  if (pending_fixtures(world) > kFew) {
    const std::vector<bool> is_near = find_near_dynamic(world);
    int32* pending = get<BroadPhaseMoved>(broad_phase);
    for (int32 i = 0; i < pending_fixtures(world); ++i) {
      const int32 proxy = pending[i];
      if (proxy == b2BroadPhase::e_nullProxy) continue;
      const auto index = static_cast<std::size_t>(proxy);
      if (index < is_near.size() && is_near[index]) continue;
      const auto* data = static_cast<const b2FixtureProxy*>(broad_phase.GetUserData(proxy));
      if (data->fixture->GetBody()->GetType() != b2_staticBody) continue;
      withdrawn.push_back(proxy);
      pending[i] = b2BroadPhase::e_nullProxy;
    }
  }
  const_cast<b2ContactManager&>(world.GetContactManager()).FindNewContacts();
  // Box2D does this for the fixtures that are pending until then.
  for (const int32 proxy : withdrawn) get<BroadPhaseTree>(broad_phase).ClearMoved(proxy);
}

void begin_step(b2World& world) {
  if (get<members::WorldNewContacts>(world)) find_new_pairs(world);
}

}  // namespace flatland
