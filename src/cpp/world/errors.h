// Exception types of the engine and the checks that stand before every call into Box2D.
//
// Debian's Box2D aborts the process on a bad argument, and its solver turns numbers beyond the
// range of a float into NaN, on which it aborts a little later. So every number is checked here.
#pragma once

#include <box2d/b2_math.h>

#include <stdexcept>
#include <string>

namespace flatland {

// A request that the engine refuses.
class PhysicsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The object behind an id was destroyed, or its world was closed.
class StaleHandleError : public PhysicsError {
 public:
  using PhysicsError::PhysicsError;
};

// The world is stepping or busy otherwise.
class WorldLockedError : public PhysicsError {
 public:
  using PhysicsError::PhysicsError;
};

// Largest magnitude of any number given to the engine; squares and cubes of it fit a float.
inline constexpr double kMaxMagnitude = 1e9;

// Shortest text that tells a number apart from others in an error.
std::string to_text(double value);

// Each returns its argument as a float, or throws std::invalid_argument that names `what`.
float checked_finite(double value, const std::string& what);
float checked_not_negative(double value, const std::string& what);
b2Vec2 checked_vector(double x, double y, const std::string& what);

// The same for many floats at once, for which `what` is an array of `width` columns.
void check_all_finite(const float* values, std::size_t count, std::size_t width,
                      const std::string& what);

}  // namespace flatland
