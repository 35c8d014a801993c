// Access to the motions of controllers, for the bindings of their kinds.
#pragma once

#include <tuple>
#include <utility>

#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "world/controllers.h"
#include "world/errors.h"

namespace flatland {

// Limits of velocity, acceleration and deceleration.
using PyLimits = std::tuple<double, double, double>;

inline double checked_limit(double limit) {
  if (!(limit >= 0.0)) {
    throw pybind11::value_error("a limit must not be negative or NaN, got " + to_text(limit));
  }
  return limit;
}

inline SpeedLimits to_limits(const PyLimits& limits) {
  const auto& [velocity, acceleration, deceleration] = limits;
  return {checked_limit(velocity), checked_limit(acceleration), checked_limit(deceleration)};
}

inline Controller& changed_controller(const ControllerHandle& handle) {
  World& world = handle.core();
  world.check_changeable();
  Controller* controller = world.jobs().find_controller(handle.id);
  if (controller == nullptr) throw StaleHandleError("the controller was removed");
  return *controller;
}

template <typename Kind>
Kind& motion_of(const ControllerHandle& handle) {
  Kind* motion = std::get_if<Kind>(&changed_controller(handle).motion);
  if (motion == nullptr) throw PhysicsError("the controller is of another kind");
  return *motion;
}

inline Id add_controller(World& world, Id body, Motion motion) {
  world.change_body(body);  // throws if it does not exist
  Controller controller;
  controller.body = body;
  controller.motion = std::move(motion);
  return world.jobs().add_controller(controller);
}

}  // namespace flatland
