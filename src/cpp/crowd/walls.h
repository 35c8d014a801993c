// The walls of a world, for queries about a neighbourhood.
#pragma once

#include <vector>

#include "crowd/segment_grid.h"
#include "vec.h"

namespace flatland::crowd {

struct NearPoint {
  Vec point;
  double distance = 0.0;
};

// Immutable, so that copies of a crowd share it.
class Walls {
 public:
  // `reach` is the greatest range of queries [m].
  Walls(std::vector<Segment> segments, double reach);

  const std::vector<Segment>& segments() const { return segments_; }
  bool empty() const { return segments_.empty(); }
  Vec low() const { return crossed_.low(); }
  Vec high() const { return crossed_.high(); }
  double reach() const { return near_.reach(); }

  // Appends the nearest points of all segments within a range.
  void find_near(Vec p, double range, std::vector<NearPoint>& found) const;
  // Returns the distance to the nearest segment, at most `range`.
  double distance(Vec p, double range) const;
  // Returns whether no segment crosses the straight line between two points.
  bool is_clear(Vec from, Vec to) const;
  // Returns whether one segment alone hides a point from all points of a rectangle.
  bool is_hidden(Vec p, Vec low, Vec high) const;
  // Returns whether a point is visible from all points of a rectangle: no segment touches the hull
  // of both.
  bool is_in_view(Vec p, Vec low, Vec high) const;

 private:
  // Returns whether test(segment) is true for any segment in the cells along a line, to which all
  // segments that cross the line belong.
  template <typename Test>
  bool any_along(Vec from, Vec to, Test&& test) const;

  std::vector<Segment> segments_;
  SegmentGrid near_;     // within `reach` of each cell
  SegmentGrid crossed_;  // that cross each cell
};

// Reduces the nearest points of segments to one point for each side on which there is a wall: keeps
// the nearest point, and each further point at an angle of at least 90 degrees to all points that
// are kept. A wall that consists of many segments thus counts once.
void keep_sides(Vec p, std::vector<NearPoint>& points);

}  // namespace flatland::crowd
