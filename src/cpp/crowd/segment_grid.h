// Segments in a grid of square cells, for queries about a neighbourhood.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "vec.h"

namespace flatland::crowd {

struct Segment {
  Vec a, b;
};

// Returns the point of a segment that is nearest to p.
inline Vec nearest_on(const Segment& segment, Vec p) {
  const Vec along = segment.b - segment.a;
  const double t = dot(p - segment.a, along) / square(along);
  // The greater one of t and 0, without the branch that compilers generate for std::max. For a
  // segment of length 0, t is NaN, and std::min returns 1.
  const double positive = 0.5 * (t + std::fabs(t));
  return segment.a + std::min(1.0, positive) * along;
}

// The greatest number of cells of a grid.
inline constexpr double kMostCells = 4e6;

// Returns the size of the cells of a grid over an area: the wanted size, or a greater size if there
// would be too many cells.
double cell_size(Vec area, double wanted);

// Returns the index of the cell at a coordinate in cells, or of the nearest one of `count` cells.
inline std::int64_t cell_index(double coordinate, std::int64_t count) {
  return static_cast<std::int64_t>(
      std::min(std::max(0.0, coordinate), static_cast<double>(count - 1)));
}

// The list of a cell contains the indices of all segments within a reach of any point of the cell,
// in ascending order, and few others, unless a condition excludes them. Immutable.
class SegmentGrid {
 public:
  // Indices of segments, in one cell or in several ones.
  struct Indices {
    const std::uint32_t* first;
    const std::uint32_t* last;

    const std::uint32_t* begin() const { return first; }
    const std::uint32_t* end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
  };

  SegmentGrid() : starts_(2, 0) {}
  // `is_listed(index, low, high)` returns whether the list of a cell, with these corners, may
  // contain a segment that is near the cell; null if all lists may.
  using IsListed = std::function<bool(std::uint32_t, Vec, Vec)>;
  SegmentGrid(const std::vector<Segment>& segments, double cell, double reach,
              const IsListed& is_listed = nullptr);

  // The area within the reach of the segments, in which points are in a cell.
  Vec low() const { return low_; }
  Vec high() const { return high_; }
  double cell() const { return cell_; }
  double reach() const { return reach_; }
  std::int64_t rows() const { return rows_; }
  // The cell of the border that is nearest to a point outside of the area counts as its cell.
  std::int64_t column_of(double x) const { return cell_index((x - low_.x) * per_metre_, columns_); }
  std::int64_t row_of(double y) const { return cell_index((y - low_.y) * per_metre_, rows_); }

  // Returns the segments near a point.
  Indices near(Vec p) const {
    const std::int64_t column = column_of(p.x);
    return in_row(row_of(p.y), column, column);
  }
  // Returns the segments near some cells of a row, a segment once for each of these cells.
  Indices in_row(std::int64_t row, std::int64_t first_column, std::int64_t last_column) const {
    const auto first = static_cast<std::size_t>(row * columns_ + first_column);
    const auto last = static_cast<std::size_t>(row * columns_ + last_column);
    return {indices_.data() + starts_[first], indices_.data() + starts_[last + 1]};
  }

 private:
  Vec low_, high_;
  double cell_ = 1.0;       // size of a cell [m]
  double per_metre_ = 1.0;  // 1 / `cell_`
  double reach_ = 0.0;
  std::int64_t columns_ = 1, rows_ = 1;
  std::vector<std::uint32_t> starts_;  // index of the first entry of each cell in `indices_`
  std::vector<std::uint32_t> indices_;
};

}  // namespace flatland::crowd
