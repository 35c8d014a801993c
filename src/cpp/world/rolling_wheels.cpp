#include "world/rolling_wheels.h"

#include <cmath>
#include <cstddef>

#include "angles.h"
#include "world/bodies.h"
#include "world/world.h"

namespace flatland {
namespace {

// Returns how far a wheel rolls for a displacement or a velocity of its centre.
double rolled(const Wheel& wheel, Vec change, double yaw) {
  const double c = std::cos(yaw + wheel.heading);
  const double s = std::sin(yaw + wheel.heading);
  return c * change.x + s * change.y - wheel.slide * (c * change.y - s * change.x);
}

// Returns the factor from the chord of an arc to its length.
double arc_of_chord(double angle) {
  const double half = 0.5 * angle;
  return std::abs(half) < 1e-6 ? 1.0 : half / std::sin(half);
}

double displacement(const Wheel& wheel, const Triple& from, const Triple& to) {
  const double turn = std::remainder(to[2] - from[2], kTwoPi);
  const double c0 = std::cos(from[2]);
  const double s0 = std::sin(from[2]);
  const double c1 = std::cos(to[2]);
  const double s1 = std::sin(to[2]);
  const double dx = to[0] - from[0] + (c1 - c0) * wheel.position.x - (s1 - s0) * wheel.position.y;
  const double dy = to[1] - from[1] + (s1 - s0) * wheel.position.x + (c1 - c0) * wheel.position.y;
  return arc_of_chord(turn) * rolled(wheel, {dx, dy}, from[2] + 0.5 * turn);
}

}  // namespace

void measure_wheels(World& world, RollingWheels& wheels) {
  for (std::size_t i = 0; i < wheels.states.size(); ++i) {
    const Wheel& wheel = (*wheels.wheels)[i];
    RollingWheels::State& state = wheels.states[i];
    const b2Body* body = world.find_body(wheel.body);
    if (body == nullptr) continue;
    const Triple pose = pose_of(*body);
    if (state.is_measured) {
      state.angle += displacement(wheel, state.pose, pose) / wheel.radius;
    }
    state.is_measured = true;
    state.pose = pose;
    const b2Vec2 velocity = body->GetLinearVelocityFromLocalPoint(
        {static_cast<float>(wheel.position.x), static_cast<float>(wheel.position.y)});
    state.speed = rolled(wheel, to_vec(velocity), pose[2]) / wheel.radius;
  }
}

void skip_motion(World& world, RollingWheels& wheels) {
  for (std::size_t i = 0; i < wheels.states.size(); ++i) {
    const b2Body* body = world.find_body((*wheels.wheels)[i].body);
    if (body != nullptr) wheels.states[i].pose = pose_of(*body);
  }
}

}  // namespace flatland
