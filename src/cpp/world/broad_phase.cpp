#include "world/broad_phase.h"

#include <box2d/b2_body.h>
#include <box2d/b2_fixture.h>

namespace flatland {
namespace {

// Box2D 2.4 has no public access to its list of pending fixtures. An explicit template
// instantiation may name private members.
template <typename Member, Member member>
struct Expose {
  friend Member expose(Member) { return member; }
};

template struct Expose<int32 b2BroadPhase::*, &b2BroadPhase::m_moveCount>;
template struct Expose<int32 * b2BroadPhase::*, &b2BroadPhase::m_moveBuffer>;
template struct Expose<b2DynamicTree b2BroadPhase::*, &b2BroadPhase::m_tree>;

int32 b2BroadPhase::*expose(int32 b2BroadPhase::*);
int32* b2BroadPhase::*expose(int32* b2BroadPhase::*);
b2DynamicTree b2BroadPhase::*expose(b2DynamicTree b2BroadPhase::*);

constexpr int32 b2BroadPhase::*kCount = nullptr;
constexpr int32* b2BroadPhase::*kBuffer = nullptr;
constexpr b2DynamicTree b2BroadPhase::*kTree = nullptr;

const b2BroadPhase& broad_phase_of(const b2World& world) {
  return world.GetContactManager().m_broadPhase;
}

}  // namespace

int32 pending_fixtures(const b2World& world) { return broad_phase_of(world).*expose(kCount); }

void skip_static_fixtures(b2World& world, int32 pending_before) {
  auto& broad_phase = const_cast<b2BroadPhase&>(broad_phase_of(world));
  int32& count = broad_phase.*expose(kCount);
  const int32* pending = broad_phase.*expose(kBuffer);
  for (int32 i = pending_before; i < count; ++i) {
    if (pending[i] != b2BroadPhase::e_nullProxy)
      (broad_phase.*expose(kTree)).ClearMoved(pending[i]);
  }
  count = pending_before;
  for (b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (body->GetType() != b2_dynamicBody) continue;
    for (b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) f->Refilter();
  }
}

}  // namespace flatland
