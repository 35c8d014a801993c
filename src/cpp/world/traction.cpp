#include "world/traction.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "vec.h"
#include "world/bodies.h"
#include "world/errors.h"
#include "world/world.h"

namespace flatland {
namespace {

// The share of a displacement that a brake corrects in one step. Any share below 1 is stable. The
// displacement under a constant force is the displacement in one step divided by the share.
constexpr double kBrakeShare = 0.5;
// The greatest distance from the pose that the brakes hold [m, rad]. A body that is farther away
// was moved, for example by a user.
constexpr double kMaxBrakeError = 0.01;

// A group of bodies as one rigid body.
struct Composite {
  double mass = 0.0;
  double inertia = 0.0;  // about the centre of mass [kg m^2]
  Vec center;            // center of mass, world frame [m]
  Vec velocity;          // of the center of mass, world frame [m/s]
  double omega = 0.0;
};

template <typename Function>
void for_each_body(World& world, const std::vector<Id>& ids, Function&& function) {
  for (const Id id : ids) {
    b2Body* body = world.find_body(id);
    if (body != nullptr && body->GetType() == b2_dynamicBody) function(*body);
  }
}

Composite composite_of(World& world, const std::vector<Id>& ids) {
  Composite whole;
  for_each_body(world, ids, [&](const b2Body& body) {
    const auto mass = static_cast<double>(body.GetMass());
    whole.mass += mass;
    whole.center += mass * to_vec(body.GetWorldCenter());
    whole.velocity += mass * to_vec(body.GetLinearVelocity());
  });
  whole.center = whole.center / whole.mass;
  whole.velocity = whole.velocity / whole.mass;
  double momentum = 0.0;
  for_each_body(world, ids, [&](const b2Body& body) {
    const auto mass = static_cast<double>(body.GetMass());
    const auto inertia = inertia_about_center<double>(body);
    const Vec offset = to_vec(body.GetWorldCenter()) - whole.center;
    const Vec velocity = to_vec(body.GetLinearVelocity()) - whole.velocity;
    whole.inertia += inertia + mass * square(offset);
    momentum +=
        inertia * static_cast<double>(body.GetAngularVelocity()) + mass * cross(offset, velocity);
  });
  if (whole.inertia > 0.0) whole.omega = momentum / whole.inertia;
  return whole;
}

// Changes the velocities of all bodies like the velocity of one rigid body.
void accelerate(World& world, const std::vector<Id>& ids, const Composite& whole,
                const Triple& change) {
  for_each_body(world, ids, [&](b2Body& body) {
    const Vec offset = to_vec(body.GetWorldCenter()) - whole.center;
    const Vec velocity = to_vec(body.GetLinearVelocity());
    const b2Vec2 linear = checked_vector(velocity.x + change[0] - change[2] * offset.y,
                                         velocity.y + change[1] + change[2] * offset.x, "velocity");
    const float omega = checked_finite(static_cast<double>(body.GetAngularVelocity()) + change[2],
                                       "velocity omega");
    body.SetLinearVelocity(linear);
    body.SetAngularVelocity(omega);
  });
}

// An impulse at a point of the group (forwards, sideways), and an angular impulse about this point.
using Impulse = Triple;

// The response of the group to impulses at a point. The vector r leads from the centre of mass to
// the point, in the frame of the driven body. The velocity of the point changes by K (jx, jy) + l /
// I x r.
struct Response {
  Response(const Composite& whole, Vec point)
      : r(point),
        inverse_inertia(whole.inertia > 0.0 ? 1.0 / whole.inertia : 0.0),
        k11(1.0 / whole.mass + r.y * r.y * inverse_inertia),
        k12(-r.x * r.y * inverse_inertia),
        k22(1.0 / whole.mass + r.x * r.x * inverse_inertia) {}

  // Solves K (jx, jy) = (vx, vy).
  void solve(double vx, double vy, Impulse& impulse) const {
    const double determinant = k11 * k22 - k12 * k12;
    impulse[0] = (k22 * vx - k12 * vy) / determinant;
    impulse[1] = (k11 * vy - k12 * vx) / determinant;
  }
  // Returns the jy of the solution for a given jx.
  void solve_sideways(double vy, Impulse& impulse) const {
    impulse[1] = (vy - k12 * impulse[0]) / k22;
  }
  double turn(const Impulse& impulse) const {
    return (impulse[2] + r.x * impulse[1] - r.y * impulse[0]) * inverse_inertia;
  }

  Vec r;
  double inverse_inertia, k11, k12, k22;
};

double share_of(double wanted, double limit) { return limit > 0.0 ? wanted / limit : HUGE_VAL; }

// Reduces an impulse to the grip of the wheels. Returns the required impulse as a multiple of the
// limit.
double limit_to_grip(const Traction& traction, const Composite& whole, double dt,
                     Impulse& impulse) {
  const double grip = traction.grip * whole.mass * dt;
  if (std::isinf(grip)) return 0.0;
  const double radius =
      traction.radius > 0.0 ? traction.radius : std::sqrt(whole.inertia / whole.mass);
  const double force = std::hypot(impulse[0], impulse[1]);
  double used = 0.0;  // used part of the limit surface
  if (force > 0.0) used = share_of(force, grip);
  if (impulse[2] != 0.0) used = std::hypot(used, share_of(std::abs(impulse[2]), grip * radius));
  if (used > 1.0) {
    for (double& each : impulse) each /= used;
  }
  return used;
}

// Reduces the force of an impulse to the force of the motors. Returns the required force as a
// multiple of the limit.
double limit_to_motors(const Traction& traction, double max_force, Impulse& impulse) {
  const double driven =
      traction.is_holonomic ? std::hypot(impulse[0], impulse[1]) : std::abs(impulse[0]);
  if (driven == 0.0) return 0.0;
  if (driven > max_force) {
    const double share = max_force / driven;
    impulse[0] *= share;
    if (traction.is_holonomic) impulse[1] *= share;
  }
  return share_of(driven, max_force);
}

// Returns the impulse that changes the velocity by `change`, in the frame of the driven body, as
// far as the limits allow. `shift` is the velocity at the point for a yaw rate of 1 if the origin
// of the body is at rest.
Impulse limited_impulse(Traction& traction, const Composite& whole, const Response& response,
                        const Triple& change, Vec shift, double dt) {
  const double max_force = traction.max_force * dt;
  const double max_torque = traction.max_torque * dt;
  // The first attempt includes a torque that changes the yaw rate as required.
  Impulse impulse{whole.mass * (change[0] + change[2] * response.r.y),
                  whole.mass * (change[1] - change[2] * response.r.x), 0.0};
  double load = limit_to_motors(traction, max_force, impulse);
  impulse[2] = whole.inertia * change[2] - response.r.x * impulse[1] + response.r.y * impulse[0];
  const double torque = std::abs(impulse[2]);
  if (torque > 0.0) load = std::max(load, share_of(torque, max_torque));
  if (torque > max_torque) {
    // With a smaller torque, the yaw rate changes less, but the point still moves as required.
    impulse[2] = std::copysign(max_torque, impulse[2]);
    const double turn = impulse[2] * response.inverse_inertia;
    const double missing = change[2] - turn;
    const double wanted_y = change[1] - turn * response.r.x - missing * shift.y;
    response.solve(change[0] + turn * response.r.y - missing * shift.x, wanted_y, impulse);
    const double force = limit_to_motors(traction, max_force, impulse);
    load = std::max(load, force);
    if (force > 1.0 && !traction.is_holonomic) response.solve_sideways(wanted_y, impulse);
  }
  traction.load = std::max(load, limit_to_grip(traction, whole, dt, impulse));
  return impulse;
}

// The state of the bodies at the beginning of a step, in the frame of the driven body.
class Push {
 public:
  Push(World& world, const b2Body& body, Traction& traction, double dt)
      : world_(world),
        traction_(traction),
        dt_(dt),
        whole_(composite_of(world, *traction.bodies)),
        pose_(pose_of(body)),
        c_(std::cos(pose_[2])),
        s_(std::sin(pose_[2])),
        origin_(to_body(Vec{pose_[0], pose_[1]} - whole_.center)),
        response_(whole_, traction.acts_at_center ? Vec{} : origin_) {}

  const Triple& pose() const { return pose_; }

  // Returns the impulse that leads to a velocity of the origin, world frame, within the limits.
  Impulse impulse_to(const Triple& velocity) const {
    const Vec target = to_body({velocity[0], velocity[1]});
    const Vec current = to_body(whole_.velocity);
    // The origin moves as required, and the point at which the forces act turns about it.
    const Vec shift = traction_.acts_at_center ? Vec{origin_.y, -origin_.x} : Vec{};
    const Triple change{
        target.x + velocity[2] * shift.x - (current.x - whole_.omega * response_.r.y),
        target.y + velocity[2] * shift.y - (current.y + whole_.omega * response_.r.x),
        velocity[2] - whole_.omega};
    return limited_impulse(traction_, whole_, response_, change, shift, dt_);
  }

  void apply(const Impulse& impulse) const {
    if (impulse[0] == 0.0 && impulse[1] == 0.0 && impulse[2] == 0.0) return;
    accelerate(world_, *traction_.bodies, whole_,
               {(c_ * impulse[0] - s_ * impulse[1]) / whole_.mass,
                (s_ * impulse[0] + c_ * impulse[1]) / whole_.mass, response_.turn(impulse)});
  }

 private:
  Vec to_body(Vec v) const { return {c_ * v.x + s_ * v.y, c_ * v.y - s_ * v.x}; }

  World& world_;
  Traction& traction_;
  double dt_;
  Composite whole_;
  Triple pose_;
  double c_, s_;
  Vec origin_;  // relative to the centre of mass
  Response response_;
};

// Returns the impulse of the brakes.
//
// An impulse acts before the contacts of the step. With brakes that only stop the body, the body
// would creep under forces that the brakes can withstand. The brakes therefore move the body back
// to the pose in which the body stopped.
Impulse brake(const Push& push, Traction& traction, double dt) {
  const Triple& pose = push.pose();
  Triple& held = traction.brake_pose;
  const bool is_near = std::hypot(held[0] - pose[0], held[1] - pose[1]) < kMaxBrakeError &&
                       std::abs(held[2] - pose[2]) < kMaxBrakeError;
  const Impulse stop = push.impulse_to({0.0, 0.0, 0.0});
  if (!traction.is_braked || !is_near || traction.load > 1.0) {
    // While a body slips, there is no pose to hold.
    traction.is_braked = traction.load <= 1.0;
    held = pose;
    return stop;
  }
  const double share = kBrakeShare / dt;
  const Impulse impulse = push.impulse_to(
      {(held[0] - pose[0]) * share, (held[1] - pose[1]) * share, (held[2] - pose[2]) * share});
  if (traction.load > 1.0) {
    // The brakes slip, and continue to pull with the greatest force.
    for (std::size_t i = 0; i < 3; ++i) held[i] = pose[i] + (held[i] - pose[i]) / traction.load;
  }
  return impulse;
}

void push_body(World& world, const b2Body& body, Traction& traction, const Triple& velocity,
               double dt) {
  const Push push(world, body, traction, dt);
  if (velocity[0] == 0.0 && velocity[1] == 0.0 && velocity[2] == 0.0) {
    push.apply(brake(push, traction, dt));
  } else {
    traction.is_braked = false;
    push.apply(push.impulse_to(velocity));
  }
}

}  // namespace

void drive(World& world, b2Body* body, Traction& traction, const Triple& velocity, double dt) {
  if (traction.is_enabled) {
    push_body(world, *body, traction, velocity, dt);
  } else {
    set_velocity(body, velocity);
  }
}

}  // namespace flatland
