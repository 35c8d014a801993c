// The walls of a world, in a grid of cells for queries about a neighbourhood.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vec.h"

namespace flatland::crowd {

struct Segment {
  Vec a, b;
};

// Returns the point of a segment that is nearest to p.
Vec nearest_on(const Segment& segment, Vec p);

struct NearPoint {
  Vec point;
  double distance = 0.0;
};

// Returns the size of the cells of a grid over an area: the wanted size, or a greater size if there
// would be more than four million cells.
double cell_size(Vec area, double wanted);

// Immutable, so that copies of a crowd share it.
class Walls {
 public:
  explicit Walls(std::vector<Segment> segments);

  bool empty() const { return segments_.empty(); }
  Vec low() const { return low_; }
  Vec high() const { return high_; }

  // Appends the nearest points of all segments within a range.
  void find_near(Vec p, double range, std::vector<NearPoint>& found) const;
  // Returns the distance to the nearest segment, at most `range`.
  double distance(Vec p, double range) const;
  // Returns whether no segment crosses the straight line between two points.
  bool is_clear(Vec from, Vec to) const;

 private:
  // A segment in a cell. The members of all cells of a row are contiguous.
  struct Member {
    Segment segment;
    std::int64_t column = 0;
  };

  template <typename Visit>
  void visit_cells(Vec low, Vec high, Visit&& visit) const;
  std::int64_t column_of(double x) const;
  std::int64_t row_of(double y) const;

  std::vector<Segment> segments_;
  Vec low_, high_;
  double cell_ = 1.0;
  std::int64_t columns_ = 0, rows_ = 0;
  // Visits the members of the cells of a row, from one column to another one.
  template <typename Visit>
  void visit_members(std::int64_t row, std::int64_t first, std::int64_t last, Visit&& visit) const;

  std::vector<std::uint32_t> starts_;  // index of the first entry of each cell in `members_`
  std::vector<Member> members_;        // cell by cell
};

// Reduces the nearest points of segments to one point for each side on which there is a wall: keeps
// the nearest point, and each further point at an angle of at least 90 degrees to all points that
// are kept. A wall that consists of many segments thus counts once.
void keep_sides(Vec p, std::vector<NearPoint>& points);

}  // namespace flatland::crowd
