#include "world/motions.h"

#include "world/box2d_members.h"

namespace flatland {
namespace {

// Box2D has no access to the sweep of a body. SetTransform would compute the sweep with rounding.
using members::BodySleepTime;
using members::BodySweep;
using members::BodyTransform;
using members::get;

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
    motions.push_back({id_of(body), get<BodyTransform>(*body), get<BodySweep>(*body),
                       body->GetLinearVelocity(), body->GetAngularVelocity(),
                       get<BodySleepTime>(*body), body->IsAwake()});
  }
  return motions;
}

void restore_motions(World& world, const std::vector<SavedMotion>& motions) {
  world.check_changeable();
  for (const SavedMotion& motion : motions) {
    if (!world.has_body(motion.body)) continue;
    const b2Body& present = *world.read_body(motion.body);
    if (present.GetType() == b2_staticBody && !is_moved(present, motion)) continue;
    b2Body* body = world.change_body(motion.body);
    if (is_moved(*body, motion)) {
      body->SetTransform(motion.transform.p, motion.sweep.a);
      if (body->GetType() == b2_staticBody) world.structure_changed();
    }
    get<BodyTransform>(*body) = motion.transform;
    get<BodySweep>(*body) = motion.sweep;
    // A change of the velocity wakes the body. The velocity of a sleeping body is 0.
    body->SetLinearVelocity(motion.linear_velocity);
    body->SetAngularVelocity(motion.angular_velocity);
    body->SetAwake(motion.awake);
    get<BodySleepTime>(*body) = motion.sleep_time;
  }
}

}  // namespace flatland
