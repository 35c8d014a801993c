#include "world/free_motion.h"

#include <box2d/b2_contact.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_settings.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "world/box2d_members.h"

namespace flatland {
namespace {

using members::get;

// Bodies with more fixtures or contacts than this are left to Box2D.
constexpr std::size_t kMostFixtures = 8;
// A body is clear of a fixture if their boxes are at least this far apart [m]. Box2D finds impacts
// at distances of up to a quarter of its slop.
constexpr float kClearance = b2_linearSlop;

struct FreeState {
  b2Vec2 center;
  float angle = 0.0F;
  b2Vec2 velocity;
  float omega = 0.0F;
  float sleep_time = 0.0F;
};

// A fixture that moves, and its new box.
struct MovedBox {
  b2FixtureProxy* proxy;
  b2AABB box;
};

struct MovedBoxes {
  std::array<MovedBox, kMostFixtures> boxes;
  std::size_t count = 0;
};

bool is_moving(const b2Body& body) {
  return body.GetType() != b2_staticBody && body.IsAwake() && body.IsEnabled();
}

// Returns the state after a step without contacts and joints, in the operations of b2Island::Solve.
// There is no gravity.
FreeState integrate(b2Body& body, float dt) {
  FreeState state;
  state.center = get<members::BodySweep>(body).c;
  state.angle = get<members::BodySweep>(body).a;
  state.velocity = body.GetLinearVelocity();
  state.omega = body.GetAngularVelocity();
  if (body.GetType() == b2_dynamicBody) {
    const b2Vec2 no_gravity(0.0F, 0.0F);
    state.velocity +=
        dt * get<members::BodyInverseMass>(body) *
        (body.GetGravityScale() * body.GetMass() * no_gravity + get<members::BodyForce>(body));
    state.omega += dt * get<members::BodyInverseInertia>(body) * get<members::BodyTorque>(body);
    state.velocity *= 1.0F / (1.0F + dt * body.GetLinearDamping());
    state.omega *= 1.0F / (1.0F + dt * body.GetAngularDamping());
  }
  const b2Vec2 translation = dt * state.velocity;
  if (b2Dot(translation, translation) > b2_maxTranslationSquared) {
    state.velocity *= b2_maxTranslation / translation.Length();
  }
  const float rotation = dt * state.omega;
  if (rotation * rotation > b2_maxRotationSquared) {
    state.omega *= b2_maxRotation / b2Abs(rotation);
  }
  state.center += dt * state.velocity;
  state.angle += dt * state.omega;
  return state;
}

// Sets the time since which the body has been at rest. Returns whether the body stays awake.
bool stays_awake(b2Body& body, FreeState& state, float dt, int position_iterations) {
  constexpr float kLinear = b2_linearSleepTolerance * b2_linearSleepTolerance;
  constexpr float kAngular = b2_angularSleepTolerance * b2_angularSleepTolerance;
  if (!body.IsSleepingAllowed() || state.omega * state.omega > kAngular ||
      b2Dot(state.velocity, state.velocity) > kLinear) {
    state.sleep_time = 0.0F;
    return true;
  }
  state.sleep_time = get<members::BodySleepTime>(body) + dt;
  return state.sleep_time < b2_timeToSleep || position_iterations < 1;
}

// Returns whether the broad phase keeps the box of a fixture, as in b2DynamicTree::MoveProxy.
bool keeps_box(const b2AABB& kept, const b2AABB& box, b2Vec2 displacement) {
  if (!kept.Contains(box)) return false;
  const b2Vec2 margin(b2_aabbExtension, b2_aabbExtension);
  b2AABB largest{box.lowerBound - margin, box.upperBound + margin};
  const b2Vec2 ahead = b2_aabbMultiplier * displacement;
  (ahead.x < 0.0F ? largest.lowerBound : largest.upperBound).x += ahead.x;
  (ahead.y < 0.0F ? largest.lowerBound : largest.upperBound).y += ahead.y;
  largest.lowerBound = largest.lowerBound - 4.0F * margin;
  largest.upperBound = largest.upperBound + 4.0F * margin;
  return largest.Contains(kept);
}

// Computes the boxes that the fixtures sweep. Returns whether the broad phase keeps all of its
// boxes.
bool sweep_boxes(b2Body& body, const b2BroadPhase& broad_phase, const b2Transform& from,
                 const b2Transform& to, MovedBoxes& moved) {
  const auto& tree = get<members::BroadPhaseTree>(const_cast<b2BroadPhase&>(broad_phase));
  for (b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (moved.count == kMostFixtures || get<members::FixtureProxyCount>(*f) != 1) return false;
    b2FixtureProxy* proxy = get<members::FixtureProxies>(*f);
    b2AABB before;
    b2AABB after;
    f->GetShape()->ComputeAABB(&before, from, proxy->childIndex);
    f->GetShape()->ComputeAABB(&after, to, proxy->childIndex);
    MovedBox& each = moved.boxes[moved.count++];
    each.proxy = proxy;
    each.box.Combine(before, after);
    const b2Vec2 displacement = after.GetCenter() - before.GetCenter();
    if (!keeps_box(tree.GetFatAABB(proxy->proxyId), each.box, displacement)) return false;
  }
  return true;
}

// Returns how far a point of a box may leave the hull of its first and last place in a step, since
// it moves on an arc [m].
float bulge(const b2AABB& box, b2Vec2 center, float rotation) {
  const float x = b2Max(b2Abs(box.lowerBound.x - center.x), b2Abs(box.upperBound.x - center.x));
  const float y = b2Max(b2Abs(box.lowerBound.y - center.y), b2Abs(box.upperBound.y - center.y));
  return 0.125F * rotation * rotation * (x + y);
}

// Returns whether a fixture stays clear of the fixtures in its contacts during a step, so that the
// step changes no contact.
bool stays_clear(b2Body& body, const FreeState& state, const b2BroadPhase& broad_phase,
                 const MovedBoxes& moved) {
  for (b2ContactEdge* edge = body.GetContactList(); edge != nullptr; edge = edge->next) {
    b2Contact& contact = *edge->contact;
    const bool is_filtered =
        (get<members::ContactFlags>(contact) & expose(members::ContactFilterFlag{})) != 0U;
    if (contact.IsTouching() || is_filtered || edge->other->GetType() != b2_staticBody) {
      return false;
    }
    const bool is_a = contact.GetFixtureA()->GetBody() == &body;
    b2Fixture* own = is_a ? contact.GetFixtureA() : contact.GetFixtureB();
    b2Fixture* other = is_a ? contact.GetFixtureB() : contact.GetFixtureA();
    const b2FixtureProxy* proxy = get<members::FixtureProxies>(*own);
    const b2FixtureProxy* other_proxy = get<members::FixtureProxies>(*other);
    if (!broad_phase.TestOverlap(proxy->proxyId, other_proxy->proxyId)) return false;
    const auto* found = std::find_if(moved.boxes.begin(), moved.boxes.begin() + moved.count,
                                     [&](const MovedBox& each) { return each.proxy == proxy; });
    const b2Sweep& sweep = get<members::BodySweep>(body);
    const float rotation = state.angle - sweep.a;
    const float gap = kClearance + b2Max(bulge(found->box, sweep.c, rotation),
                                         bulge(found->box, state.center, rotation));
    const b2Vec2 margin(gap, gap);
    const b2AABB swept{found->box.lowerBound - margin, found->box.upperBound + margin};
    // Written so that NaN is not clear.
    if (!(swept.lowerBound.x > other_proxy->aabb.upperBound.x ||
          swept.lowerBound.y > other_proxy->aabb.upperBound.y ||
          swept.upperBound.x < other_proxy->aabb.lowerBound.x ||
          swept.upperBound.y < other_proxy->aabb.lowerBound.y)) {
      return false;
    }
  }
  return true;
}

// Returns the pose of the body frame for a pose of the center of mass.
b2Transform transform_of(b2Rot rotation, b2Vec2 center, b2Vec2 local_center) {
  return {center - b2Mul(rotation, local_center), rotation};
}

// Moves a body if it is free. Returns whether it is.
bool move(b2Body& body, const b2BroadPhase& broad_phase, float dt, int position_iterations) {
  if (body.GetJointList() != nullptr) return false;
  FreeState state = integrate(body, dt);
  if (!stays_awake(body, state, dt, position_iterations)) return false;
  b2Sweep& sweep = get<members::BodySweep>(body);
  b2Transform& transform = get<members::BodyTransform>(body);
  // The rotation of the transform is always that of the angle of the sweep.
  const b2Transform from = transform_of(transform.q, sweep.c, sweep.localCenter);
  const b2Transform to = transform_of(b2Rot(state.angle), state.center, sweep.localCenter);
  MovedBoxes moved;
  if (!sweep_boxes(body, broad_phase, from, to, moved) ||
      !stays_clear(body, state, broad_phase, moved)) {
    return false;
  }
  sweep.c0 = sweep.c;
  sweep.a0 = sweep.a;
  sweep.alpha0 = 0.0F;
  sweep.c = state.center;
  sweep.a = state.angle;
  transform = to;
  get<members::BodyVelocity>(body) = state.velocity;
  get<members::BodyOmega>(body) = state.omega;
  get<members::BodySleepTime>(body) = state.sleep_time;
  get<members::BodyForce>(body).SetZero();
  get<members::BodyTorque>(body) = 0.0F;
  for (std::size_t i = 0; i < moved.count; ++i) moved.boxes[i].proxy->aabb = moved.boxes[i].box;
  return true;
}

}  // namespace

bool FreeMotion::begin(b2World& world, float dt, int position_iterations) {
  moved_.clear();
  const b2BroadPhase& broad_phase = world.GetContactManager().m_broadPhase;
  // The next step searches for new contacts of bodies that were created or moved from outside.
  if (get<members::WorldNewContacts>(world) || !get<members::WorldStepComplete>(world) ||
      get<members::BroadPhaseMovedCount>(const_cast<b2BroadPhase&>(broad_phase)) > 0) {
    return false;
  }
  bool is_all = true;
  for (b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (!is_moving(*body)) continue;
    if (move(*body, broad_phase, dt, position_iterations)) {
      moved_.push_back(body);
    } else {
      is_all = false;
    }
  }
  if (is_all) {
    get<members::WorldLastRate>(world) = 1.0F / dt;
    return true;
  }
  // Box2D ignores bodies that sleep, except if another body moves against them.
  for (b2Body* body : moved_) {
    get<members::BodyFlags>(*body) &= static_cast<std::uint16_t>(~expose(members::BodyAwakeFlag{}));
  }
  return false;
}

void FreeMotion::end() {
  for (b2Body* body : moved_) {
    get<members::BodyFlags>(*body) |= static_cast<std::uint16_t>(expose(members::BodyAwakeFlag{}));
  }
}

}  // namespace flatland
