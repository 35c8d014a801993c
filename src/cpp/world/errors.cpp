#include "world/errors.h"

#include <cmath>
#include <cstdio>

namespace flatland {
namespace {

// Returns false for NaN.
bool in_range(double value) { return std::abs(value) <= kMaxMagnitude; }

[[noreturn]] void throw_out_of_range(double value, const std::string& what) {
  throw std::invalid_argument(what + " must be finite and within +-" + to_text(kMaxMagnitude) +
                              ", got " + to_text(value));
}

}  // namespace

std::string to_text(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

float checked_finite(double value, const std::string& what) {
  if (!in_range(value)) throw_out_of_range(value, what);
  return static_cast<float>(value);
}

float checked_not_negative(double value, const std::string& what) {
  if (value < 0.0) {
    throw std::invalid_argument(what + " must not be negative, got " + to_text(value));
  }
  return checked_finite(value, what);
}

b2Vec2 checked_vector(double x, double y, const std::string& what) {
  if (!in_range(x) || !in_range(y)) {
    throw std::invalid_argument(what + " must be finite and within +-" + to_text(kMaxMagnitude) +
                                ", got (" + to_text(x) + ", " + to_text(y) + ")");
  }
  return {static_cast<float>(x), static_cast<float>(y)};
}

void check_all_finite(const float* values, std::size_t count, std::size_t width,
                      const std::string& what) {
  constexpr float limit = static_cast<float>(kMaxMagnitude);
  // The first pass has no branches, so that the compiler can vectorize the loop. The second pass
  // finds the index of the invalid element.
  bool all = true;
  for (std::size_t i = 0; i < count; ++i) all &= std::abs(values[i]) <= limit;
  if (all) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (!in_range(static_cast<double>(values[i]))) {
      throw_out_of_range(
          static_cast<double>(values[i]),
          what + "[" + std::to_string(i / width) + ", " + std::to_string(i % width) + "]");
    }
  }
}

}  // namespace flatland
