#include "world/free_motion.h"

#include <box2d/b2_circle_shape.h>
#include <box2d/b2_contact.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_settings.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "world/box2d_members.h"
#include "world/broad_phase.h"

namespace flatland {
namespace {

using free_motion::FreeState;
using free_motion::kMostFixtures;
using free_motion::Move;
using free_motion::MovedBox;
using members::get;

// A body is clear of a fixture if their boxes are at least this far apart [m]. Box2D finds impacts
// at distances of up to a quarter of its slop.
constexpr float kClearance = b2_linearSlop;

// For how many steps a body can coast.
struct Room {
  int steps = 0;
  bool is_turning = false;  // whether the rotation has an effect on its boxes
};

bool is_moving(const b2Body& body) { return body.IsAwake() && body.IsEnabled(); }

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

// Returns whether a body with a velocity cannot fall asleep.
bool is_kept_awake(b2Body& body, b2Vec2 velocity, float omega) {
  constexpr float kLinear = b2_linearSleepTolerance * b2_linearSleepTolerance;
  constexpr float kAngular = b2_angularSleepTolerance * b2_angularSleepTolerance;
  return !body.IsSleepingAllowed() || omega * omega > kAngular ||
         b2Dot(velocity, velocity) > kLinear;
}

// Sets the time since which the body has been at rest. Returns whether the body stays awake.
bool stays_awake(b2Body& body, FreeState& state, float dt, int position_iterations) {
  if (is_kept_awake(body, state.velocity, state.omega)) {
    state.sleep_time = 0.0F;
    return true;
  }
  state.sleep_time = get<members::BodySleepTime>(body) + dt;
  return state.sleep_time < b2_timeToSleep || position_iterations < 1;
}

// The sides of a box: its lower bounds and its negative upper bounds. All sides of a larger box are
// less, so that each operation on boxes is one on vectors. The results are those of Box2D, since
// rounding is symmetric.
using Sides = float __attribute__((vector_size(16)));
using SideMask = std::int32_t __attribute__((vector_size(16)));

constexpr Sides kSigns = {1.0F, 1.0F, -1.0F, -1.0F};
constexpr Sides kFatMargin = {b2_aabbExtension, b2_aabbExtension, b2_aabbExtension,
                              b2_aabbExtension};

Sides sides_of(const b2AABB& box) {
  static_assert(sizeof(b2AABB) == sizeof(Sides));
  return __builtin_bit_cast(Sides, box) * kSigns;
}

b2AABB box_of(Sides sides) { return __builtin_bit_cast(b2AABB, sides * kSigns); }

Sides least(Sides a, Sides b) { return a < b ? a : b; }

bool is_true(SideMask mask) {
  using Halves = std::int64_t __attribute__((vector_size(16)));
  const auto halves = __builtin_bit_cast(Halves, mask);
  return (halves[0] & halves[1]) == -1;
}

// Returns the sides of the box of a shape. That of a circle, as many robots and all people are,
// does not need the call of a library.
Sides sides_of(const b2Shape& shape, const b2Transform& transform, int32 child) {
  if (shape.GetType() == b2Shape::e_circle) {
    const auto& circle = static_cast<const b2CircleShape&>(shape);
    const b2Vec2 center = transform.p + b2Mul(transform.q, circle.m_p);
    return Sides{center.x, center.y, -center.x, -center.y} - circle.m_radius;
  }
  b2AABB box;
  shape.ComputeAABB(&box, transform, child);
  return sides_of(box);
}

Sides magnitude(Sides a) {
  constexpr std::int32_t kMagnitude = 0x7FFFFFFF;
  return __builtin_bit_cast(Sides, __builtin_bit_cast(SideMask, a) & kMagnitude);
}

Sides opposite(Sides a) { return Sides{a[2], a[3], a[0], a[1]}; }

// Returns the center of a box, and its negative.
Sides center_of(Sides sides) { return 0.5F * (sides - opposite(sides)); }

// Returns the box of a fixture in the broad phase after a move, as in b2DynamicTree::MoveProxy. The
// displacement is that of all sides.
Sides fat_box(Sides box, Sides displacement) {
  return box - kFatMargin + least(b2_aabbMultiplier * displacement, Sides{});
}

// Returns whether the broad phase keeps the box of a fixture, as in b2DynamicTree::MoveProxy.
bool keeps_box(const b2AABB& kept_box, Sides box, Sides displacement) {
  const Sides kept = sides_of(kept_box);
  const Sides largest = fat_box(box, displacement) - 4.0F * kFatMargin;
  return is_true((kept <= box) & (largest <= kept));
}

// Computes the boxes that the fixtures sweep. Returns false if there are too many.
bool sweep_boxes(b2Body& body, const b2BroadPhase& broad_phase, const b2Transform& from,
                 Move& move) {
  const auto& tree = get<members::BroadPhaseTree>(broad_phase);
  for (b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (move.count == kMostFixtures || get<members::FixtureProxyCount>(*f) != 1) return false;
    b2FixtureProxy* proxy = get<members::FixtureProxies>(*f);
    const Sides before = sides_of(*f->GetShape(), from, proxy->childIndex);
    const Sides after = sides_of(*f->GetShape(), move.to, proxy->childIndex);
    const Sides swept = least(before, after);
    const Sides displacement = center_of(after) - center_of(before);
    if (!keeps_box(tree.GetFatAABB(proxy->proxyId), swept, displacement)) move.are_kept = false;
    move.boxes[move.count++] = {proxy, box_of(swept), {displacement[0], displacement[1]}};
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
bool stays_clear(b2Body& body, const b2BroadPhase& broad_phase, const Move& move) {
  const FreeState& state = move.state;
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
    const auto* found = std::find_if(move.boxes.begin(), move.boxes.begin() + move.count,
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

// Computes the move of a body. Returns false if the body is not free.
bool plan(b2Body& body, const b2BroadPhase& broad_phase, float dt, int position_iterations,
          Move& move) {
  if (body.GetJointList() != nullptr) return false;
  move.body = &body;
  move.state = integrate(body, dt);
  if (!stays_awake(body, move.state, dt, position_iterations)) return false;
  const b2Sweep& sweep = get<members::BodySweep>(body);
  // The rotation of the transform is always that of the angle of the sweep.
  const b2Rot rotation = body.GetTransform().q;
  const b2Transform from = transform_of(rotation, sweep.c, sweep.localCenter);
  move.to = transform_of(b2Rot(move.state.angle), move.state.center, sweep.localCenter);
  return sweep_boxes(body, broad_phase, from, move) &&
         (move.are_kept || body.GetType() == b2_kinematicBody) &&
         stays_clear(body, broad_phase, move);
}

// Returns whether the new boxes of a move overlap those of bodies in the broad phase.
bool meets(const Move& move, const std::vector<b2Body*>& bodies, const b2BroadPhase& broad_phase) {
  const auto& tree = get<members::BroadPhaseTree>(broad_phase);
  const auto overlaps = [&](b2Fixture& fixture, const b2AABB& box) {
    const b2FixtureProxy* proxies = get<members::FixtureProxies>(fixture);
    return std::any_of(proxies, proxies + get<members::FixtureProxyCount>(fixture),
                       [&](const b2FixtureProxy& proxy) {
                         return b2TestOverlap(box, tree.GetFatAABB(proxy.proxyId));
                       });
  };
  for (std::size_t i = 0; i < move.count; ++i) {
    const b2Vec2 moved = move.boxes[i].displacement;
    const b2AABB box =
        box_of(fat_box(sides_of(move.boxes[i].box), Sides{moved.x, moved.y, -moved.x, -moved.y}));
    for (b2Body* body : bodies) {
      for (b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
        if (overlaps(*f, box)) return true;
      }
    }
  }
  return false;
}

// Returns a bound of the distance of the points of a fixture from the center of mass, for its box.
// The rotation of a circle has no effect on its box, so that only its center counts: with 0, the
// rotation of the body has no effect on the box.
float reach_of(const b2Shape& shape, const b2AABB& box, const b2Sweep& sweep) {
  if (shape.GetType() == b2Shape::e_circle) {
    return static_cast<const b2CircleShape&>(shape).m_p.Length() + sweep.localCenter.Length();
  }
  const b2Vec2 farthest = b2Max(b2Abs(box.lowerBound - sweep.c), b2Abs(box.upperBound - sweep.c));
  return farthest.Length();
}

// Returns for how many steps a kinematic body will certainly be free and keep its boxes in the
// broad phase, with the velocity that it has; 0 for less than two steps, or if that takes more to
// find out.
Room room_of(b2Body& body, const b2BroadPhase& broad_phase, float dt) {
  constexpr float kRounding = 0x1p-20F;  // a bound of the relative errors in a step
  constexpr float kFew = 2.0F;
  constexpr float kMany = 1000.0F;
  const b2Vec2 velocity = body.GetLinearVelocity();
  const float omega = body.GetAngularVelocity();
  const b2Sweep& sweep = get<members::BodySweep>(body);
  const float rotation = dt * b2Abs(omega) + kRounding * b2Abs(sweep.a);
  if (body.GetContactList() != nullptr || body.GetJointList() != nullptr ||
      !is_kept_awake(body, velocity, omega) || !(rotation < 1.0F)) {
    return {};
  }
  const auto& tree = get<members::BroadPhaseTree>(broad_phase);
  const b2Vec2 moved = dt * velocity;
  const Sides displacement = {moved.x, moved.y, -moved.x, -moved.y};
  Sides steps = {kMany, kMany, kMany, kMany};
  Room room;
  for (b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (get<members::FixtureProxyCount>(*f) != 1) return {};
    const b2FixtureProxy& proxy = *get<members::FixtureProxies>(*f);
    const Sides box = sides_of(*f->GetShape(), body.GetTransform(), proxy.childIndex);
    const Sides kept = sides_of(tree.GetFatAABB(proxy.proxyId));
    const float reach = reach_of(*f->GetShape(), box_of(box), sweep);
    const Sides size = magnitude(box) + magnitude(opposite(box));  // at least that of the center
    const Sides error = rotation * reach + kRounding * (size + reach);
    // The bounds of `keeps_box`, where the displacement has this error, too.
    const Sides largest = fat_box(box, displacement) - 4.0F * kFatMargin;
    const Sides slack = least(box - kept, kept - largest - b2_aabbMultiplier * error);
    steps = least(steps, slack / (magnitude(displacement) + error));
    room.is_turning = room.is_turning || reach > 0.0F;
  }
  if (!is_true(steps >= kFew)) return {};  // nor NaN
  const Sides least_of_axes = least(steps, opposite(steps));
  room.steps = static_cast<int>(b2Min(least_of_axes[0], least_of_axes[1]));
  return room;
}

// Sets the state of a body after a step.
void set_state(b2Body& body, const FreeState& state, const b2Transform& transform) {
  b2Sweep& sweep = get<members::BodySweep>(body);
  sweep.c0 = sweep.c;
  sweep.a0 = sweep.a;
  sweep.alpha0 = 0.0F;
  sweep.c = state.center;
  sweep.a = state.angle;
  get<members::BodyTransform>(body) = transform;
  get<members::BodyVelocity>(body) = state.velocity;
  get<members::BodyOmega>(body) = state.omega;
  get<members::BodySleepTime>(body) = state.sleep_time;
  get<members::BodyForce>(body).SetZero();
  get<members::BodyTorque>(body) = 0.0F;
}

void carry_out(const Move& move, b2BroadPhase& broad_phase) {
  set_state(*move.body, move.state, move.to);
  auto& tree = get<members::BroadPhaseTree>(broad_phase);
  for (std::size_t i = 0; i < move.count; ++i) {
    const MovedBox& each = move.boxes[i];
    each.proxy->aabb = each.box;
    if (move.are_kept) continue;
    tree.MoveProxy(each.proxy->proxyId, each.box, each.displacement);
    // Box2D clears the mark after its search for new contacts.
    tree.ClearMoved(each.proxy->proxyId);
  }
}

// Moves a body by some steps of those that `room_of` has returned.
void carry_out(b2Body& body, std::int64_t steps, bool is_turning, float dt) {
  b2Sweep& sweep = get<members::BodySweep>(body);
  FreeState state;
  state.velocity = body.GetLinearVelocity();
  state.omega = body.GetAngularVelocity();
  // No speed is limited within the boxes.
  const b2Vec2 translation = dt * state.velocity;
  const float rotation = dt * state.omega;
  for (std::int64_t i = 1; i < steps; ++i) {
    sweep.c += translation;
    sweep.a += rotation;
  }
  state.center = sweep.c + translation;
  state.angle = sweep.a + rotation;
  const b2Rot before = is_turning ? b2Rot(sweep.a) : body.GetTransform().q;
  const b2Transform from = transform_of(before, sweep.c, sweep.localCenter);
  const b2Transform to = transform_of(b2Rot(state.angle), state.center, sweep.localCenter);
  set_state(body, state, to);
  for (b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    b2FixtureProxy& proxy = *get<members::FixtureProxies>(*f);
    const b2Shape& shape = *f->GetShape();
    proxy.aabb = box_of(
        least(sides_of(shape, from, proxy.childIndex), sides_of(shape, to, proxy.childIndex)));
  }
}

void set_awake(b2Body& body, bool is_awake) {
  // b2Body::SetAwake would also change the velocity and the time at rest.
  const auto flag = static_cast<std::uint16_t>(expose(members::BodyAwakeFlag{}));
  std::uint16_t& flags = get<members::BodyFlags>(body);
  flags = static_cast<std::uint16_t>(is_awake ? flags | flag : flags & ~flag);
}

}  // namespace

bool FreeMotion::begin(b2World& world, const BodiesByType& bodies, float dt,
                       int position_iterations, bool may_coast) {
  moved_.clear();
  leaving_.clear();
  b2BroadPhase& broad_phase = broad_phase_of(world);
  // The next step searches for new contacts of bodies that were created or moved from outside.
  if (get<members::WorldNewContacts>(world) || !get<members::WorldStepComplete>(world) ||
      get<members::BroadPhaseMovedCount>(broad_phase) > 0) {
    catch_up();
    return false;
  }
  world_ = &world;
  dt_ = dt;
  if (step_ == next_end_) finish([this](const Coasting& each) { return each.end == step_; });
  ++step_;
  if (pause_ > 0) --pause_;
  may_coast = may_coast && pause_ == 0;
  bool is_all = true;
  const auto move_body = [&](b2Body* body) {
    Move& move = leaving_.emplace_back();
    const bool is_free = plan(*body, broad_phase, dt, position_iterations, move);
    if (is_free && move.are_kept) {
      carry_out(move, broad_phase);
      moved_.push_back(body);
    }
    if (!is_free || move.are_kept) leaving_.pop_back();
    is_all = is_all && is_free;
  };
  for (b2Body* body : bodies.dynamic) {
    if (is_moving(*body)) move_body(body);
  }
  if (coasting_.size() < bodies.kinematic.size()) {  // otherwise, all coast
    for (b2Body* body : bodies.kinematic) {
      if (is_moving(*body) && !(may_coast && start_coasting(*body))) move_body(body);
    }
  }
  // The broad phase depends on the order in which boxes move. It is that of Box2D if all bodies are
  // free, since those above have moved no box.
  is_all = is_all && std::none_of(leaving_.begin(), leaving_.end(), [&](const Move& move) {
             return meets(move, bodies.dynamic, broad_phase);
           });
  if (is_all) {
    for (const Move& move : leaving_) carry_out(move, broad_phase);
    get<members::WorldLastRate>(world) = 1.0F / dt;
    return true;
  }
  for (const Coasting& each : coasting_) moved_.push_back(each.body);
  catch_up();
  // Box2D ignores bodies that sleep, except if another body moves against them.
  for (b2Body* body : moved_) set_awake(*body, false);
  return false;
}

void FreeMotion::end() {
  for (b2Body* body : moved_) set_awake(*body, true);
}

bool FreeMotion::start_coasting(b2Body& body) {
  const Room room = room_of(body, broad_phase_of(*world_), dt_);
  if (room.steps == 0) return false;
  const std::int64_t begin = step_ - 1;
  coasting_.push_back({&body, begin, begin + room.steps, room.is_turning});
  next_end_ = std::min(next_end_, coasting_.back().end);
  set_awake(body, false);
  return true;
}

void FreeMotion::catch_up() {
  if (coasting_.empty()) return;
  constexpr int kPause = 4;
  if (step_ - coasting_.front().begin < 2) pause_ = kPause;
  finish([](const Coasting&) { return true; });
}

template <typename Condition>
void FreeMotion::finish(Condition condition) {
  next_end_ = kNever;
  std::size_t kept = 0;
  for (const Coasting& each : coasting_) {
    if (!condition(each)) {
      next_end_ = std::min(next_end_, each.end);
      coasting_[kept++] = each;
      continue;
    }
    set_awake(*each.body, true);
    carry_out(*each.body, step_ - each.begin, each.is_turning, dt_);
  }
  coasting_.resize(kept);
}

}  // namespace flatland
