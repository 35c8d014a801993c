#include "world/traction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "world/bodies.h"
#include "world/errors.h"
#include "world/world.h"

namespace flatland {
namespace {

// The share of a displacement that a brake corrects in one step. Any share below 1 is stable; the
// displacement under a constant force is that of one step divided by the share.
constexpr double kBrakeShare = 0.5;
// A body that is farther away from its brake pose was moved by something else [m, rad].
constexpr double kMaxBrakeError = 0.01;

// A group of bodies, as one rigid body.
struct Composite {
  double mass = 0.0;
  double inertia = 0.0;  // about the centre of mass [kg m^2]
  double center[2] = {0.0, 0.0};
  double velocity[2] = {0.0, 0.0};
  double omega = 0.0;
};

double inertia_of(const b2Body& body) {
  return static_cast<double>(body.GetInertia()) -
         static_cast<double>(body.GetMass()) *
             static_cast<double>(body.GetLocalCenter().LengthSquared());
}

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
    const b2Vec2& center = body.GetWorldCenter();
    const b2Vec2& velocity = body.GetLinearVelocity();
    whole.mass += mass;
    whole.center[0] += mass * static_cast<double>(center.x);
    whole.center[1] += mass * static_cast<double>(center.y);
    whole.velocity[0] += mass * static_cast<double>(velocity.x);
    whole.velocity[1] += mass * static_cast<double>(velocity.y);
  });
  for (int i = 0; i < 2; ++i) {
    whole.center[i] /= whole.mass;
    whole.velocity[i] /= whole.mass;
  }
  double momentum = 0.0;
  for_each_body(world, ids, [&](const b2Body& body) {
    const auto mass = static_cast<double>(body.GetMass());
    const double inertia = inertia_of(body);
    const double x = static_cast<double>(body.GetWorldCenter().x) - whole.center[0];
    const double y = static_cast<double>(body.GetWorldCenter().y) - whole.center[1];
    const double vx = static_cast<double>(body.GetLinearVelocity().x) - whole.velocity[0];
    const double vy = static_cast<double>(body.GetLinearVelocity().y) - whole.velocity[1];
    whole.inertia += inertia + mass * (x * x + y * y);
    momentum += inertia * static_cast<double>(body.GetAngularVelocity()) + mass * (x * vy - y * vx);
  });
  if (whole.inertia > 0.0) whole.omega = momentum / whole.inertia;
  return whole;
}

// Changes the velocities of all bodies as those of one rigid body.
void accelerate(World& world, const std::vector<Id>& ids, const Composite& whole,
                const Triple& change) {
  for_each_body(world, ids, [&](b2Body& body) {
    const double x = static_cast<double>(body.GetWorldCenter().x) - whole.center[0];
    const double y = static_cast<double>(body.GetWorldCenter().y) - whole.center[1];
    const b2Vec2& velocity = body.GetLinearVelocity();
    const b2Vec2 linear =
        checked_vector(static_cast<double>(velocity.x) + change[0] - change[2] * y,
                       static_cast<double>(velocity.y) + change[1] + change[2] * x, "velocity");
    const float omega = checked_finite(static_cast<double>(body.GetAngularVelocity()) + change[2],
                                       "velocity omega");
    body.SetLinearVelocity(linear);
    body.SetAngularVelocity(omega);
  });
}

// An impulse at a point of the group (forwards, sideways) and an angular one about that point.
using Impulse = Triple;

// The response of the group to impulses at a point: r is its position relative to the centre of
// mass, in the frame of the driven body. The change of velocity there is K (jx, jy) + l / I x r.
struct Response {
  Response(const Composite& whole, double x, double y)
      : rx(x),
        ry(y),
        inverse_inertia(whole.inertia > 0.0 ? 1.0 / whole.inertia : 0.0),
        k11(1.0 / whole.mass + y * y * inverse_inertia),
        k12(-x * y * inverse_inertia),
        k22(1.0 / whole.mass + x * x * inverse_inertia) {}

  // Solves K (jx, jy) = (vx, vy).
  void solve(double vx, double vy, Impulse& impulse) const {
    const double determinant = k11 * k22 - k12 * k12;
    impulse[0] = (k22 * vx - k12 * vy) / determinant;
    impulse[1] = (k11 * vy - k12 * vx) / determinant;
  }
  // The same for jy, for a given jx.
  void solve_sideways(double vy, Impulse& impulse) const {
    impulse[1] = (vy - k12 * impulse[0]) / k22;
  }
  double turn(const Impulse& impulse) const {
    return (impulse[2] + rx * impulse[1] - ry * impulse[0]) * inverse_inertia;
  }

  double rx, ry, inverse_inertia, k11, k12, k22;
};

double share_of(double wanted, double limit) { return limit > 0.0 ? wanted / limit : HUGE_VAL; }

// Reduces an impulse to the grip of the wheels. Returns the part of it that was required.
double limit_to_grip(const Traction& traction, const Composite& whole, double dt,
                     Impulse& impulse) {
  const double grip = traction.grip * whole.mass * dt;
  if (std::isinf(grip)) return 0.0;
  const double radius =
      traction.radius > 0.0 ? traction.radius : std::sqrt(whole.inertia / whole.mass);
  const double force = std::hypot(impulse[0], impulse[1]);
  double used = 0.0;  // of the limit surface
  if (force > 0.0) used = share_of(force, grip);
  if (impulse[2] != 0.0) used = std::hypot(used, share_of(std::abs(impulse[2]), grip * radius));
  if (used > 1.0) {
    for (double& each : impulse) each /= used;
  }
  return used;
}

// Returns the impulse that changes the velocity by `change`, in the frame of the driven body, as
// far as the limits allow. `shift` is the change of the velocity at the point for each unit by
// which the change of the yaw rate is less.
Impulse limited_impulse(Traction& traction, const Composite& whole, const Response& response,
                        const Triple& change, const double* shift, double dt) {
  const double max_force = traction.max_force * dt;
  const double max_torque = traction.max_torque * dt;
  Impulse impulse{};
  // Without limits, both the velocity and the yaw rate change as required.
  impulse[0] = whole.mass * (change[0] + change[2] * response.ry);
  impulse[1] = whole.mass * (change[1] - change[2] * response.rx);
  impulse[2] = whole.inertia * change[2] - response.rx * impulse[1] + response.ry * impulse[0];
  double load = 0.0;
  double wanted_x = change[0];
  double wanted_y = change[1];
  const double torque = std::abs(impulse[2]);
  if (torque > 0.0) load = share_of(torque, max_torque);
  if (torque > max_torque) {
    impulse[2] = std::copysign(max_torque, impulse[2]);
    const double turn = impulse[2] * response.inverse_inertia;
    wanted_x += turn * response.ry - (change[2] - turn) * shift[0];
    wanted_y -= turn * response.rx + (change[2] - turn) * shift[1];
    response.solve(wanted_x, wanted_y, impulse);
  }
  const double driven =
      traction.is_holonomic ? std::hypot(impulse[0], impulse[1]) : std::abs(impulse[0]);
  if (driven > 0.0) load = std::max(load, share_of(driven, max_force));
  if (driven > max_force) {
    const double share = max_force / driven;
    impulse[0] *= share;
    if (traction.is_holonomic) {
      impulse[1] *= share;
    } else if (torque > max_torque) {
      response.solve_sideways(wanted_y, impulse);
    }
  }
  traction.load = std::max(load, limit_to_grip(traction, whole, dt, impulse));
  return impulse;
}

// Replaces a velocity of zero by one that leads back to the pose at which the robot was braked.
//
// An impulse acts before the contacts of the step: a brake without memory would let the body creep
// under forces that it can withstand.
void hold_brakes(Traction& traction, const Triple& pose, double dt, Triple& velocity) {
  if (velocity[0] != 0.0 || velocity[1] != 0.0 || velocity[2] != 0.0) {
    traction.is_braked = false;
    return;
  }
  const Triple& held = traction.brake_pose;
  const bool is_near = std::hypot(held[0] - pose[0], held[1] - pose[1]) < kMaxBrakeError &&
                       std::abs(held[2] - pose[2]) < kMaxBrakeError;
  if (!traction.is_braked || !is_near) traction.brake_pose = pose;
  traction.is_braked = true;
  for (std::size_t i = 0; i < 3; ++i) velocity[i] = (held[i] - pose[i]) * kBrakeShare / dt;
}

void push(World& world, b2Body* body, Traction& traction, Triple velocity, double dt) {
  const Composite whole = composite_of(world, *traction.bodies);
  const Triple pose = pose_of(*body);
  hold_brakes(traction, pose, dt, velocity);
  const double c = std::cos(pose[2]);
  const double s = std::sin(pose[2]);
  const auto to_body = [&](double x, double y) {
    return std::array<double, 2>{c * x + s * y, c * y - s * x};
  };
  // From the centre of mass to the origin, and the velocities of both in the frame of the body.
  const auto origin = to_body(pose[0] - whole.center[0], pose[1] - whole.center[1]);
  const auto target = to_body(velocity[0], velocity[1]);
  const auto current = to_body(whole.velocity[0], whole.velocity[1]);
  const bool is_at_center = traction.acts_at_center;
  const double rx = is_at_center ? 0.0 : origin[0];
  const double ry = is_at_center ? 0.0 : origin[1];
  // Of the point at which the forces act: the origin moves as required, the rest turns about it.
  const double shift[2] = {is_at_center ? origin[1] : 0.0, is_at_center ? -origin[0] : 0.0};
  const Triple change{target[0] + velocity[2] * shift[0] - (current[0] - whole.omega * ry),
                      target[1] + velocity[2] * shift[1] - (current[1] + whole.omega * rx),
                      velocity[2] - whole.omega};
  const Response response(whole, rx, ry);
  const Impulse impulse = limited_impulse(traction, whole, response, change, shift, dt);
  if (traction.load > 1.0) traction.is_braked = false;
  if (impulse[0] == 0.0 && impulse[1] == 0.0 && impulse[2] == 0.0) return;
  accelerate(world, *traction.bodies, whole,
             {(c * impulse[0] - s * impulse[1]) / whole.mass,
              (s * impulse[0] + c * impulse[1]) / whole.mass, response.turn(impulse)});
}

}  // namespace

void drive(World& world, b2Body* body, Traction& traction, const Triple& velocity, double dt) {
  if (traction.is_enabled) {
    push(world, body, traction, velocity, dt);
  } else {
    set_velocity(body, velocity);
  }
}

}  // namespace flatland
