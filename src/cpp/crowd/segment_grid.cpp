#include "crowd/segment_grid.h"

#include <algorithm>
#include <cmath>

namespace flatland::crowd {

double cell_size(Vec area, double wanted) {
  constexpr double kMostCells = 4e6;
  return std::max(
      {wanted, std::sqrt(area.x * area.y / kMostCells), std::max(area.x, area.y) / kMostCells});
}

SegmentGrid::SegmentGrid(const std::vector<Segment>& segments, double cell, double reach)
    : reach_(reach) {
  if (!segments.empty()) low_ = high_ = segments[0].a;
  for (const Segment& segment : segments) {
    for (const Vec p : {segment.a, segment.b}) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y)};
      high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y)};
    }
  }
  const Vec size = high_ - low_;
  cell_ = cell_size(size, cell);
  columns_ = static_cast<std::int64_t>(size.x / cell_) + 1;
  rows_ = static_cast<std::int64_t>(size.y / cell_) + 1;
  // The first pass counts the segments near each cell, the second pass stores their indices.
  starts_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  each_near(segments, [&](std::size_t place, std::uint32_t) { ++starts_[place + 1]; });
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  indices_.resize(starts_.back());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  each_near(segments, [&](std::size_t place, std::uint32_t i) { indices_[next[place]++] = i; });
}

// Calls visit(cell, index) for each cell and each segment near it.
template <typename Visit>
void SegmentGrid::each_near(const std::vector<Segment>& segments, Visit&& visit) const {
  const double reach = reach_ + 1e-6;  // m, including a rounding error
  const double half_diagonal = 0.5 * std::sqrt(2.0) * cell_;
  const double most = reach + half_diagonal * (1.0 + 1e-6);
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    const Segment& s = segments[i];
    const std::int64_t first_column = column_of(std::min(s.a.x, s.b.x) - reach);
    const std::int64_t last_column = column_of(std::max(s.a.x, s.b.x) + reach);
    const std::int64_t last_row = row_of(std::max(s.a.y, s.b.y) + reach);
    for (std::int64_t row = row_of(std::min(s.a.y, s.b.y) - reach); row <= last_row; ++row) {
      for (std::int64_t column = first_column; column <= last_column; ++column) {
        const Vec center{low_.x + (static_cast<double>(column) + 0.5) * cell_,
                         low_.y + (static_cast<double>(row) + 0.5) * cell_};
        if (square(nearest_on(s, center) - center) > most * most) continue;
        visit(static_cast<std::size_t>(row * columns_ + column), i);
      }
    }
  }
}

}  // namespace flatland::crowd
