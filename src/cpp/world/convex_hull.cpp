#include "world/convex_hull.h"

#include <box2d/b2_common.h>

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "vec.h"

namespace flatland {
namespace {

// The relative rounding error of a cross product in single precision.
constexpr double kCrossRounding = 4.0 * static_cast<double>(b2_epsilon);

// The least area of the triangle of a corner and its neighbours, relative to that of the hull.
constexpr double kLeastCorner = 1e-7;

// Returns twice the area of a triangle, positive if it is counter-clockwise.
double left_turn(b2Vec2 a, b2Vec2 b, b2Vec2 c) {
  return cross(to_vec(b) - to_vec(a), to_vec(c) - to_vec(a));
}

// Returns twice the area of a polygon.
double twice_area(const std::vector<b2Vec2>& corners) {
  double sum = 0.0;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    sum += left_turn(corners[0], corners[i - 1], corners[i]);
  }
  return sum;
}

// Whether Box2D begins a hull with a point rather than with another one.
bool is_more_right(const b2Vec2& a, const b2Vec2& b) {
  return a.x > b.x || (a.x == b.x && a.y < b.y);
}

std::vector<b2Vec2> monotone_chain(std::vector<b2Vec2> points) {
  // From right to left, so that the chains begin with the first corner of Box2D.
  std::sort(points.begin(), points.end(), is_more_right);
  std::vector<b2Vec2> hull;
  const auto add = [&](b2Vec2 point, std::size_t least) {
    while (hull.size() > least && left_turn(hull[hull.size() - 2], hull.back(), point) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(point);
  };
  for (const b2Vec2& point : points) add(point, 1);
  const std::size_t upper = hull.size();
  std::for_each(points.rbegin() + 1, points.rend(), [&](b2Vec2 point) { add(point, upper); });
  hull.pop_back();  // the first corner again
  return hull;
}

void drop_flat_corners(std::vector<b2Vec2>& hull) {
  const double least = kLeastCorner * twice_area(hull);
  while (hull.size() > 3) {
    const std::size_t n = hull.size();
    const auto height = [&](std::size_t i) {
      return left_turn(hull[(i + n - 1) % n], hull[i], hull[(i + 1) % n]);
    };
    std::size_t flattest = 0;
    for (std::size_t i = 1; i < n; ++i) {
      if (height(i) < height(flattest)) flattest = i;
    }
    if (height(flattest) > least) return;
    hull.erase(hull.begin() + static_cast<std::ptrdiff_t>(flattest));
  }
}

}  // namespace

std::vector<b2Vec2> weld_points(const std::vector<b2Vec2>& points) {
  constexpr float min_distance = 0.5F * b2_linearSlop;
  std::vector<b2Vec2> kept;
  for (const b2Vec2& point : points) {
    const bool is_new = std::none_of(kept.begin(), kept.end(), [&](const b2Vec2& other) {
      return b2DistanceSquared(point, other) < min_distance * min_distance;
    });
    if (is_new) kept.push_back(point);
  }
  return kept;
}

std::vector<b2Vec2> box2d_hull(const std::vector<b2Vec2>& points) {
  const auto start = static_cast<std::size_t>(
      std::min_element(points.begin(), points.end(), is_more_right) - points.begin());
  std::vector<b2Vec2> hull;
  std::size_t at = start;
  do {
    if (hull.size() == static_cast<std::size_t>(b2_maxPolygonVertices)) return {};
    hull.push_back(points[at]);
    std::size_t next = 0;
    for (std::size_t candidate = 1; candidate < points.size(); ++candidate) {
      if (next == at) {
        next = candidate;
        continue;
      }
      const b2Vec2 to_next = points[next] - hull.back();
      const b2Vec2 to_candidate = points[candidate] - hull.back();
      const float turn = b2Cross(to_next, to_candidate);
      const bool is_farther = to_candidate.LengthSquared() > to_next.LengthSquared();
      if (turn < 0.0F || (turn == 0.0F && is_farther)) next = candidate;
    }
    at = next;
  } while (at != start);
  return hull;
}

std::vector<b2Vec2> exact_hull(const std::vector<b2Vec2>& points) {
  std::vector<b2Vec2> corners = monotone_chain(points);
  drop_flat_corners(corners);
  const auto is_corner = [&](const b2Vec2& point) {
    return std::find(corners.begin(), corners.end(), point) != corners.end();
  };
  std::vector<b2Vec2> in_order;
  std::copy_if(points.begin(), points.end(), std::back_inserter(in_order), is_corner);
  return monotone_chain(weld_points(in_order));
}

bool has_corners(const std::vector<b2Vec2>& hull, const std::vector<b2Vec2>& corners) {
  double longest = 0.0;
  for (const b2Vec2& corner : corners) {
    longest = std::max(longest, length(to_vec(corner) - to_vec(corners[0])));
  }
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const b2Vec2 from = hull[i];
    const b2Vec2 to = hull[(i + 1) % hull.size()];
    const double side = length(to_vec(to) - to_vec(from));
    // A corner may be outside by the rounding error, if hardly any area is missing.
    const double least = -kCrossRounding * std::min(twice_area(corners), side * longest);
    const auto is_outside = [&](const b2Vec2& corner) {
      return left_turn(from, to, corner) < least;
    };
    if (std::any_of(corners.begin(), corners.end(), is_outside)) return false;
  }
  return hull.size() >= 3;
}

}  // namespace flatland
