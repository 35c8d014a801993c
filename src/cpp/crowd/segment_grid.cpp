#include "crowd/segment_grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace flatland::crowd {

double cell_size(Vec area, double wanted) {
  return std::max(
      {wanted, std::sqrt(area.x * area.y / kMostCells), std::max(area.x, area.y) / kMostCells});
}

SegmentGrid::SegmentGrid(const std::vector<Segment>& segments, double cell, double reach,
                         const IsListed& is_listed)
    : reach_(reach) {
  if (!segments.empty()) low_ = high_ = segments[0].a;
  for (const Segment& segment : segments) {
    for (const Vec p : {segment.a, segment.b}) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y)};
      high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y)};
    }
  }
  low_ -= {reach, reach};
  high_ += {reach, reach};
  const Vec size = high_ - low_;
  cell_ = cell_size(size, cell);
  per_metre_ = 1.0 / cell_;
  columns_ = static_cast<std::int64_t>(size.x * per_metre_) + 1;
  rows_ = static_cast<std::int64_t>(size.y * per_metre_) + 1;
  starts_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  std::vector<std::pair<std::size_t, std::uint32_t>> entries;  // cells and segments
  constexpr double kRounding = 1e-6;                           // m
  const double reach_of_cell = reach + kRounding;
  const double reach_of_center = reach_of_cell + 0.5 * std::sqrt(2.0) * cell_;
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    const Segment& s = segments[i];
    const double first_x = std::min(s.a.x, s.b.x);
    const double last_x = std::max(s.a.x, s.b.x);
    const double slope = (s.b.x - s.a.x) / (s.b.y - s.a.y);
    const std::int64_t last_row = row_of(std::max(s.a.y, s.b.y) + reach_of_cell);
    for (std::int64_t row = row_of(std::min(s.a.y, s.b.y) - reach_of_cell); row <= last_row;
         ++row) {
      // The part of the segment that is near this row; a horizontal segment is near as a whole.
      double begin = first_x;
      double end = last_x;
      if (s.a.y != s.b.y) {
        const double y = low_.y + (static_cast<double>(row) + 0.5) * cell_ - s.a.y;
        const double x1 = s.a.x + slope * (y - reach_of_center);
        const double x2 = s.a.x + slope * (y + reach_of_center);
        begin = std::max(begin, std::min(x1, x2) - kRounding);
        end = std::min(end, std::max(x1, x2) + kRounding);
      }
      const std::int64_t first_column =
          column_of(std::max(begin - reach_of_center, first_x - reach_of_cell));
      const std::int64_t last_column =
          column_of(std::min(end + reach_of_center, last_x + reach_of_cell));
      for (std::int64_t column = first_column; column <= last_column; ++column) {
        const Vec corner =
            low_ + cell_ * Vec{static_cast<double>(column), static_cast<double>(row)};
        const Vec diagonal{cell_, cell_};
        const Vec center = corner + 0.5 * diagonal;
        if (length(nearest_on(s, center) - center) > reach_of_center) continue;
        const Vec margin{kRounding, kRounding};
        if (is_listed && !is_listed(i, corner - margin, corner + diagonal + margin)) continue;
        entries.emplace_back(static_cast<std::size_t>(row * columns_ + column), i);
        ++starts_[entries.back().first + 1];
      }
    }
  }
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  indices_.resize(entries.size());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (const auto& [place, i] : entries) indices_[next[place]++] = i;
}

}  // namespace flatland::crowd
