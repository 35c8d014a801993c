// Penner's easing curves: the acceleration profiles of a motion between two poses.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace flatland {

// Maps progress from 0 to 1 to the covered fraction of the path. It is exactly 0 and 1 at the ends;
// back and elastic curves leave [0, 1] in between.
struct Easing {
  enum class Family : std::uint8_t {
    kLinear,
    kQuadratic,
    kCubic,
    kQuartic,
    kQuintic,
    kExponential,
    kCircular,
    kBack,
    kElastic,
    kBounce,
  };
  enum class Shape : std::uint8_t { kIn, kOut, kInOut };

  double operator()(double p) const;

  Family family = Family::kLinear;
  Shape shape = Shape::kIn;
};

// Returns the curve of a name, such as `cubicInOut`; throws std::invalid_argument if it is unknown.
Easing easing_of(const std::string& name);
// Returns the names of all curves.
std::vector<std::string> easing_names();

}  // namespace flatland
