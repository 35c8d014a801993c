// Access to controllers by id, for the bindings of their kinds.
#pragma once

#include <tuple>
#include <utility>

#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "world/controllers.h"
#include "world/errors.h"

namespace flatland {

using Limits = std::tuple<double, double, double>;

inline double checked_limit(double limit) {
  if (!(limit >= 0.0)) {
    throw pybind11::value_error("a limit must not be negative or NaN, got " + to_text(limit));
  }
  return limit;
}

inline SpeedLimits to_limits(const Limits& limits) {
  const auto& [velocity, acceleration, deceleration] = limits;
  return {checked_limit(velocity), checked_limit(acceleration), checked_limit(deceleration)};
}

inline Controller& changed_controller(World& world, Id id) {
  world.check_changeable();
  Controller* controller = world.plan().find_controller(id);
  if (controller == nullptr) throw StaleHandleError("the controller was removed");
  return *controller;
}

template <typename Kind>
Kind& motion_of(World& world, Id id) {
  Kind* motion = std::get_if<Kind>(&changed_controller(world, id).motion);
  if (motion == nullptr) throw PhysicsError("the controller is of another kind");
  return *motion;
}

inline Id add_controller(World& world, Id body, Motion motion) {
  world.change_body(body);  // throws if it does not exist
  Controller controller;
  controller.body = body;
  controller.motion = std::move(motion);
  return world.plan().add_controller(controller);
}

}  // namespace flatland
