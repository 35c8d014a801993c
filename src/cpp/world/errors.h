// Exception types of the engine, and checks of the arguments of Box2D functions.
//
// The Debian package of Box2D is built with assertions: an invalid argument aborts the process, as
// does a NaN that results from an overflow in the solver. All numbers are therefore checked before
// they are passed to Box2D.
#pragma once

#include <box2d/b2_math.h>

#include <stdexcept>
#include <string>

namespace flatland {

// A request that cannot be executed.
class PhysicsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The object with the id was destroyed, or its world was closed.
class StaleHandleError : public PhysicsError {
 public:
  using PhysicsError::PhysicsError;
};

// The world is stepping or otherwise in use.
class WorldLockedError : public PhysicsError {
 public:
  using PhysicsError::PhysicsError;
};

// The largest magnitude of numbers that are passed to the engine. The square and the cube of this
// number are in the range of a float.
inline constexpr double kMaxMagnitude = 1e9;

// Returns the number in up to 9 significant digits, for error messages.
std::string to_text(double value);

// Return the argument as a float. Throw std::invalid_argument with the name `what` if it is
// invalid.
float checked_finite(double value, const std::string& what);
float checked_not_negative(double value, const std::string& what);
b2Vec2 checked_vector(double x, double y, const std::string& what);

// Checks `count` elements of an array named `what` with `width` columns.
void check_all_finite(const float* values, std::size_t count, std::size_t width,
                      const std::string& what);

}  // namespace flatland
