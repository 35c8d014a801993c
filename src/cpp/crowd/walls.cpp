#include "crowd/walls.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace flatland::crowd {
namespace {

constexpr double kCell = 0.5;  // m

bool crosses(const Segment& segment, Vec from, Vec to) {
  const Vec along = to - from;
  const Vec side = segment.b - segment.a;
  return cross(along, segment.a - from) * cross(along, segment.b - from) <= 0.0 &&
         cross(side, from - segment.a) * cross(side, to - segment.a) <= 0.0;
}

}  // namespace

Vec nearest_on(const Segment& segment, Vec p) {
  const Vec along = segment.b - segment.a;
  const double size = square(along);
  if (size == 0.0) return segment.a;
  const double t = std::min(std::max(dot(p - segment.a, along) / size, 0.0), 1.0);
  return segment.a + t * along;
}

double cell_size(Vec area, double wanted) {
  constexpr double kMostCells = 4e6;
  return std::max(
      {wanted, std::sqrt(area.x * area.y / kMostCells), std::max(area.x, area.y) / kMostCells});
}

Walls::Walls(std::vector<Segment> segments) : segments_(std::move(segments)) {
  if (segments_.empty()) return;
  low_ = high_ = segments_[0].a;
  for (const Segment& segment : segments_) {
    for (const Vec p : {segment.a, segment.b}) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y)};
      high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y)};
    }
  }
  const Vec size = high_ - low_;
  cell_ = cell_size(size, kCell);
  columns_ = static_cast<std::int64_t>(size.x / cell_) + 1;
  rows_ = static_cast<std::int64_t>(size.y / cell_) + 1;
  // The first pass counts the segments in each cell, the second pass stores the segments.
  starts_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  const double reach = 0.5 * std::sqrt(2.0) * cell_ * (1.0 + 1e-6);
  const auto each_cell = [&](auto&& visit) {
    for (std::uint32_t i = 0; i < segments_.size(); ++i) {
      const Segment& s = segments_[i];
      visit_cells({std::min(s.a.x, s.b.x), std::min(s.a.y, s.b.y)},
                  {std::max(s.a.x, s.b.x), std::max(s.a.y, s.b.y)},
                  [&](std::int64_t column, std::int64_t row) {
                    const Vec center{low_.x + (static_cast<double>(column) + 0.5) * cell_,
                                     low_.y + (static_cast<double>(row) + 0.5) * cell_};
                    if (square(nearest_on(s, center) - center) > reach * reach) return;
                    visit(static_cast<std::size_t>(row * columns_ + column), i);
                  });
    }
  };
  each_cell([&](std::size_t cell, std::uint32_t) { ++starts_[cell + 1]; });
  for (std::size_t cell = 1; cell < starts_.size(); ++cell) starts_[cell] += starts_[cell - 1];
  members_.resize(starts_.back());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  each_cell([&](std::size_t cell, std::uint32_t i) {
    const auto column = static_cast<std::int64_t>(cell) % columns_;
    members_[next[cell]++] = {segments_[i], column};
  });
}

std::int64_t Walls::column_of(double x) const {
  const double column = (x - low_.x) / cell_;
  return static_cast<std::int64_t>(
      std::min(std::max(column, 0.0), static_cast<double>(columns_ - 1)));
}

std::int64_t Walls::row_of(double y) const {
  const double row = (y - low_.y) / cell_;
  return static_cast<std::int64_t>(std::min(std::max(row, 0.0), static_cast<double>(rows_ - 1)));
}

template <typename Visit>
void Walls::visit_cells(Vec low, Vec high, Visit&& visit) const {
  const std::int64_t last_column = column_of(high.x);
  const std::int64_t last_row = row_of(high.y);
  for (std::int64_t row = row_of(low.y); row <= last_row; ++row) {
    for (std::int64_t column = column_of(low.x); column <= last_column; ++column) {
      visit(column, row);
    }
  }
}

template <typename Visit>
void Walls::visit_members(std::int64_t row, std::int64_t first, std::int64_t last,
                          Visit&& visit) const {
  const std::uint32_t end = starts_[static_cast<std::size_t>(row * columns_ + last) + 1];
  for (std::uint32_t k = starts_[static_cast<std::size_t>(row * columns_ + first)]; k < end; ++k) {
    visit(members_[k]);
  }
}

void Walls::find_near(Vec p, double range, std::vector<NearPoint>& found) const {
  if (empty()) return;
  const double most = range * range * (1.0 + 1e-9);  // including a rounding error
  const std::int64_t first_column = column_of(p.x - range);
  const std::int64_t last_column = column_of(p.x + range);
  const std::int64_t last_row = row_of(p.y + range);
  for (std::int64_t row = row_of(p.y - range); row <= last_row; ++row) {
    visit_members(row, first_column, last_column, [&](const Member& member) {
      const Vec point = nearest_on(member.segment, p);
      if (square(point - p) > most) return;
      // A segment can be in several cells, and is found in the cell of the nearest point.
      if (column_of(point.x) != member.column || row_of(point.y) != row) return;
      const double distance = length(point - p);
      if (distance <= range) found.push_back({point, distance});
    });
  }
}

double Walls::distance(Vec p, double range) const {
  if (empty()) return range;
  double nearest = range * range;
  const std::int64_t first_column = column_of(p.x - range);
  const std::int64_t last_column = column_of(p.x + range);
  const std::int64_t last_row = row_of(p.y + range);
  for (std::int64_t row = row_of(p.y - range); row <= last_row; ++row) {
    visit_members(row, first_column, last_column, [&](const Member& member) {
      nearest = std::min(nearest, square(nearest_on(member.segment, p) - p));
    });
  }
  return std::sqrt(nearest);
}

bool Walls::is_clear(Vec from, Vec to) const {
  if (empty()) return true;
  constexpr double kRounding = 1e-6;  // m
  const auto [low, high] = from.y < to.y ? std::pair(from, to) : std::pair(to, from);
  const double slope = (high.x - low.x) / std::max(high.y - low.y, kRounding);
  const std::int64_t last_row = row_of(high.y);
  for (std::int64_t row = row_of(low.y); row <= last_row; ++row) {
    // The part of the line in a row of cells. The first and the last row have no outer limit.
    const double bottom = low_.y + static_cast<double>(row) * cell_;
    double begin = low.x;
    double end = high.x;
    if (row > 0 && bottom > low.y) begin += slope * (bottom - low.y);
    if (row + 1 < rows_ && bottom + cell_ < high.y) end -= slope * (high.y - bottom - cell_);
    const std::int64_t last_column = column_of(std::max(begin, end) + kRounding);
    bool is_clear = true;
    visit_members(
        row, column_of(std::min(begin, end) - kRounding), last_column,
        [&](const Member& member) { is_clear = is_clear && !crosses(member.segment, from, to); });
    if (!is_clear) return false;
  }
  return true;
}

void keep_sides(Vec p, std::vector<NearPoint>& points) {
  constexpr double kTolerance = 1e-6;  // greatest cosine of a right angle, because of rounding
  const auto is_nearer = [](const NearPoint& a, const NearPoint& b) {
    return std::tie(a.distance, a.point.x, a.point.y) < std::tie(b.distance, b.point.x, b.point.y);
  };
  for (auto rest = points.begin(); rest != points.end();) {
    std::iter_swap(rest, std::min_element(rest, points.end(), is_nearer));
    const Vec direction = unit(rest->point - p);
    ++rest;
    const auto is_same_side = [&](const NearPoint& each) {
      return !(dot(unit(each.point - p), direction) <= kTolerance);
    };
    points.erase(std::remove_if(rest, points.end(), is_same_side), points.end());
  }
}

}  // namespace flatland::crowd
