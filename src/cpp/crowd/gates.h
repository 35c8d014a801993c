// Doors and other narrow passages. People pass a gate in one direction at a time.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "crowd/flow_field.h"
#include "crowd/walls.h"
#include "vec.h"

namespace flatland::crowd {

inline constexpr double kGateReach = 4.0;   // distance within which people approach a passage [m]
inline constexpr double kThreshold = 0.35;  // space on both sides that belongs to the passage [m]

// A straight passage that is too narrow for two people side by side.
struct Gate {
  Vec center;
  Vec axis;                 // unit vector along the passage
  double half_width = 0.0;  // [m]
  double half_depth = 0.0;  // half of the length of the narrow part along the axis [m]
  double radius2 = 0.0;     // square of the radius of a disc that contains the passage [m²]

  // Returns half of the length of the passage with its thresholds [m].
  double half_length() const { return half_depth + kThreshold; }
  // Returns whether a point at an offset from the center is in the passage.
  bool contains(Vec offset) const {
    return std::fabs(dot(offset, axis)) < half_length() &&
           std::fabs(cross(axis, offset)) < half_width;
  }
};

// Returns the narrow passages of a grid, in ascending order of x.
std::vector<Gate> find_gates(const FreeGrid& grid, const Walls& walls);

// The people at a gate. Index 0 of an array is the direction against the axis, index 1 the
// direction along the axis.
struct Demand {
  std::uint32_t inside[2] = {0, 0};   // number of people in the passage
  std::uint32_t waiting[2] = {0, 0};  // number of people in front of the passage
  // Least distance of the waiting people [m].
  double nearest[2] = {std::numeric_limits<double>::infinity(),
                       std::numeric_limits<double>::infinity()};
};

// The direction that has the right of way at a gate. The directions take turns; people in the
// passage leave before the next turn begins.
struct Signal {
  std::uint32_t gate = 0;
  std::int8_t direction = -1;      // index of the direction, -1 for none
  bool is_closing = false;         // whether only people in the passage may walk on
  std::int64_t opposed_since = 0;  // step since which people wait in the other direction, or 0

  // Updates the signal in a step; `dt` is the duration of a step [s].
  void update(const Demand& demand, std::int64_t step, double dt);
};

}  // namespace flatland::crowd
