#include "world/broad_phase.h"

#include <box2d/b2_body.h>
#include <box2d/b2_fixture.h>

#include "world/box2d_members.h"

namespace flatland {
namespace {

using members::BroadPhaseMoved;
using members::BroadPhaseMovedCount;
using members::BroadPhaseTree;
using members::get;

const b2BroadPhase& broad_phase_of(const b2World& world) {
  return world.GetContactManager().m_broadPhase;
}

}  // namespace

int32 pending_fixtures(const b2World& world) {
  return get<BroadPhaseMovedCount>(broad_phase_of(world));
}

void skip_static_fixtures(b2World& world, int32 pending_before) {
  auto& broad_phase = const_cast<b2BroadPhase&>(broad_phase_of(world));
  int32& count = get<BroadPhaseMovedCount>(broad_phase);
  const int32* pending = get<BroadPhaseMoved>(broad_phase);
  for (int32 i = pending_before; i < count; ++i) {
    if (pending[i] != b2BroadPhase::e_nullProxy)
      get<BroadPhaseTree>(broad_phase).ClearMoved(pending[i]);
  }
  count = pending_before;
  for (b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (body->GetType() != b2_dynamicBody) continue;
    for (b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) f->Refilter();
  }
}

}  // namespace flatland
