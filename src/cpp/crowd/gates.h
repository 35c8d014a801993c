// Doors and other narrow passages, which people pass in one direction at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "crowd/flow_field.h"
#include "crowd/vec.h"
#include "crowd/walls.h"

namespace flatland::crowd {

// A straight passage in which two people hardly pass each other.
struct Gate {
  Vec center;
  Vec axis;                 // unit vector along the passage
  double half_width = 0.0;  // [m]
  double half_depth = 0.0;  // of the narrow part, along the axis [m]
};

// Returns the narrow passages of a grid, in ascending order of x.
std::vector<Gate> find_gates(const FreeGrid& grid, const Walls& walls);

// What happens at a gate. Index 0 of arrays is the direction against the axis, 1 that along it.
struct Demand {
  std::uint32_t inside[2] = {0, 0};   // people in the passage
  std::uint32_t waiting[2] = {0, 0};  // people in front of it
  double nearest[2] = {0.0, 0.0};     // least distance of those [m]
};

// Which direction has the right of way. People in both directions take turns: those in the passage
// leave it first.
struct Signal {
  std::int8_t direction = -1;      // index of the direction, -1 for none
  bool is_closing = false;         // whether only those in the passage may go on
  std::int64_t opposed_since = 0;  // step since which somebody waits in the other direction, or 0

  // Updates the signal in some step; `dt` is the duration of a step [s].
  void update(const Demand& demand, std::int64_t step, double dt);
};

}  // namespace flatland::crowd
