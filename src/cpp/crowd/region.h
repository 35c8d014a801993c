// The part of a world in which people walk, for which ways are computed.
#pragma once

#include <optional>
#include <vector>

#include "crowd/segment_grid.h"
#include "vec.h"

namespace flatland::crowd {

// A rectangle, empty at first.
struct Box {
  Vec low, high;
  bool is_empty = true;

  void add(Vec p);
  void add(const Box& other);
  // Returns the rectangle that is larger by a margin [m] on all sides.
  Box widened(double margin) const;
  Vec size() const { return high - low; }
  // Returns whether a rectangle has no point in common with this one.
  bool is_apart(const Box& other) const;
};

Box box_of(const std::vector<Segment>& segments);

// The space around walls and places that belongs to their region [m]: people walk around walls.
inline constexpr double kBorder = 1.0;

struct Region {
  Box box;                  // without the space around it
  bool is_partial = false;  // whether walls outside of the box are ignored
};

// Returns the region of walls and places in which cells of a size [m] are not too many: all of
// them, or only those places and the walls that belong together with them. Walls belong together if
// the gaps between them are smaller than a distance, which is as great as possible. Without places,
// the region is that of the most walls. Throws PhysicsError if there is no such region.
Region find_region(const std::vector<Segment>& walls, const std::vector<Box>& places, double cell);

// Returns the parts of segments that are in a box.
std::vector<Segment> clipped(const std::vector<Segment>& segments, const Box& box);

}  // namespace flatland::crowd
