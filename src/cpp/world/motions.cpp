#include "world/motions.h"

namespace flatland {
namespace {

// Box2D derives the sweep of a body from its transform, with rounding, and has no access to it. An
// explicit template instantiation may name private members.
template <typename Member, Member member>
struct Expose {
  friend Member expose(Member) { return member; }
};

template struct Expose<b2Transform b2Body::*, &b2Body::m_xf>;
template struct Expose<b2Sweep b2Body::*, &b2Body::m_sweep>;

b2Transform b2Body::*expose(b2Transform b2Body::*);
b2Sweep b2Body::*expose(b2Sweep b2Body::*);

constexpr b2Transform b2Body::*kTransform = nullptr;
constexpr b2Sweep b2Body::*kSweep = nullptr;

// A tag, because b2Body has several members of type float.
struct SleepTime {
  using Pointer = float b2Body::*;
  friend Pointer expose(SleepTime);
};
template <float b2Body::*pointer>
struct ExposeSleepTime {
  friend float b2Body::*expose(SleepTime) { return pointer; }
};
template struct ExposeSleepTime<&b2Body::m_sleepTime>;

bool is_moved(const b2Body& body, const SavedMotion& motion) {
  const b2Vec2& position = body.GetPosition();
  return position.x != motion.transform.p.x || position.y != motion.transform.p.y ||
         body.GetAngle() != motion.sweep.a;
}

}  // namespace

std::vector<SavedMotion> saved_motions(const World& world) {
  world.check_readable();
  std::vector<SavedMotion> motions;
  motions.reserve(static_cast<std::size_t>(world.engine().GetBodyCount()));
  for (const b2Body* body = world.engine().GetBodyList(); body != nullptr; body = body->GetNext()) {
    motions.push_back({id_of(body), body->*expose(kTransform), body->*expose(kSweep),
                       body->GetLinearVelocity(), body->GetAngularVelocity(),
                       body->*expose(SleepTime{}), body->IsAwake()});
  }
  return motions;
}

void restore_motions(World& world, const std::vector<SavedMotion>& motions) {
  world.check_changeable();
  for (const SavedMotion& motion : motions) {
    if (!world.has_body(motion.body)) continue;
    b2Body* body = world.change_body(motion.body);
    if (is_moved(*body, motion)) body->SetTransform(motion.transform.p, motion.sweep.a);
    body->*expose(kTransform) = motion.transform;
    body->*expose(kSweep) = motion.sweep;
    // A change of the velocity wakes the body; sleep sets it to 0, as it was.
    body->SetLinearVelocity(motion.linear_velocity);
    body->SetAngularVelocity(motion.angular_velocity);
    body->SetAwake(motion.awake);
    body->*expose(SleepTime{}) = motion.sleep_time;
  }
}

}  // namespace flatland
