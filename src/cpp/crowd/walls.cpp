#include "crowd/walls.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>

namespace flatland::crowd {
namespace {

constexpr double kCell = 0.5;  // m

bool crosses(const Segment& segment, Vec from, Vec to) {
  const Vec along = to - from;
  const Vec side = segment.b - segment.a;
  const double ends = cross(along, segment.a - from) * cross(along, segment.b - from);
  const double others = cross(side, from - segment.a) * cross(side, to - segment.a);
  return std::max(ends, others) <= 0.0;
}

}  // namespace

Walls::Walls(std::vector<Segment> segments, double reach)
    : segments_(std::move(segments)),
      // The size bounds the number of cells near a segment.
      near_(segments_, std::max(kCell, reach / 3.0), reach),
      crossed_(segments_, kCell, 0.0) {}

void Walls::find_near(Vec p, double range, std::vector<NearPoint>& found) const {
  assert(range <= reach());
  const double most = range * range * (1.0 + 1e-9);  // including a rounding error
  const SegmentGrid::Indices near = near_.near(p);
  const std::size_t before = found.size();
  found.resize(before + near.size());
  // Whether a segment is within the range cannot be predicted. Without a branch, each point is
  // stored, and the next one replaces it if it is out of range.
  NearPoint* end = found.data() + before;
  for (const std::uint32_t i : near) {
    const Vec point = nearest_on(segments_[i], p);
    const double distance2 = square(point - p);
    *end = {point, distance2};
    end += static_cast<std::ptrdiff_t>(distance2 <= most);
  }
  NearPoint* kept = found.data() + before;
  for (const NearPoint* each = kept; each != end; ++each) {
    const double distance = std::sqrt(each->distance);
    if (distance <= range) *kept++ = {each->point, distance};
  }
  found.resize(static_cast<std::size_t>(kept - found.data()));
}

double Walls::distance(Vec p, double range) const {
  assert(range <= reach());
  double nearest = range * range;
  for (const std::uint32_t i : near_.near(p)) {
    nearest = std::min(nearest, square(nearest_on(segments_[i], p) - p));
  }
  return std::sqrt(nearest);
}

template <typename Test>
bool Walls::any_along(Vec from, Vec to, Test&& test) const {
  constexpr double kRounding = 1e-6;  // m
  const auto [low, high] = from.y < to.y ? std::pair(from, to) : std::pair(to, from);
  const double slope = (high.x - low.x) / std::max(high.y - low.y, kRounding);
  const double cell = crossed_.cell();
  const std::int64_t last_row = crossed_.row_of(high.y);
  for (std::int64_t row = crossed_.row_of(low.y); row <= last_row; ++row) {
    // The part of the line in a row of cells. The first and the last row have no outer limit.
    const double bottom = crossed_.low().y + static_cast<double>(row) * cell;
    double begin = low.x;
    double end = high.x;
    if (row > 0 && bottom > low.y) begin += slope * (bottom - low.y);
    if (row + 1 < crossed_.rows() && bottom + cell < high.y) {
      end -= slope * (high.y - bottom - cell);
    }
    const std::int64_t first_column = crossed_.column_of(std::min(begin, end) - kRounding);
    const std::int64_t last_column = crossed_.column_of(std::max(begin, end) + kRounding);
    bool is_found = false;
    for (const std::uint32_t i : crossed_.in_row(row, first_column, last_column)) {
      is_found |= test(segments_[i]);
    }
    if (is_found) return true;
  }
  return false;
}

bool Walls::is_clear(Vec from, Vec to) const {
  return !any_along(from, to, [&](const Segment& segment) { return crosses(segment, from, to); });
}

bool Walls::is_hidden(Vec p, Vec low, Vec high) const {
  // The shadow of a segment is convex, so that it contains the rectangle if it contains the
  // corners.
  return any_along(0.5 * (low + high), p, [&](const Segment& segment) {
    return crosses(segment, low, p) && crosses(segment, high, p) &&
           crosses(segment, {low.x, high.y}, p) && crosses(segment, {high.x, low.y}, p);
  });
}

bool Walls::is_in_view(Vec p, Vec low, Vec high) const {
  if (!is_clear(p, 0.5 * (low + high))) return false;  // quickly, in most cases
  constexpr double kRounding = 1e-6;                   // m
  // A segment and the hull are apart if their projections onto a normal of a side of either are.
  // The sides of the hull are among those of the rectangle and the lines from the point to the
  // corners.
  const std::array<Vec, 5> points{p, low, {high.x, low.y}, high, {low.x, high.y}};
  struct Projection {
    Vec normal;
    double least, most;
  };
  const auto project = [&](Vec normal) {
    Projection onto{normal, dot(normal, p), dot(normal, p)};
    for (const Vec point : points) {
      onto.least = std::min(onto.least, dot(normal, point) - kRounding);
      onto.most = std::max(onto.most, dot(normal, point) + kRounding);
    }
    return onto;
  };
  const Projection onto_x = project({1.0, 0.0});
  const Projection onto_y = project({0.0, 1.0});
  std::array<Projection, 6> hull{onto_x, onto_y};
  for (std::size_t i = 1; i < points.size(); ++i) {
    hull[i + 1] = project(left_of(unit(points[i] - p)));
  }
  const auto touches_hull = [&](const Segment& s) {
    const auto is_apart = [&](const Projection& onto) {
      const double a = dot(onto.normal, s.a);
      const double b = dot(onto.normal, s.b);
      return std::max(a, b) < onto.least || std::min(a, b) > onto.most;
    };
    return std::none_of(hull.begin(), hull.end(), is_apart) &&
           !is_apart(project(left_of(unit(s.b - s.a))));
  };
  const std::int64_t first_column = crossed_.column_of(onto_x.least);
  const std::int64_t last_column = crossed_.column_of(onto_x.most);
  const std::int64_t last_row = crossed_.row_of(onto_y.most);
  for (std::int64_t row = crossed_.row_of(onto_y.least); row <= last_row; ++row) {
    const SegmentGrid::Indices near = crossed_.in_row(row, first_column, last_column);
    const auto touches = [&](std::uint32_t i) { return touches_hull(segments_[i]); };
    if (std::any_of(near.begin(), near.end(), touches)) return false;
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
      return dot(each.point - p, direction) > kTolerance * each.distance;
    };
    points.erase(std::remove_if(rest, points.end(), is_same_side), points.end());
  }
}

}  // namespace flatland::crowd
