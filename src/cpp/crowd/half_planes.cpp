#include "crowd/half_planes.h"

#include <algorithm>
#include <cmath>

namespace flatland::crowd {
namespace {

constexpr double kParallel = 1e-9;  // greatest sine of the angle between parallel lines

// The objective: the point nearest to `aim`, or the farthest point in the direction `aim`.
struct Objective {
  Vec aim;
  bool is_direction = false;
};

// Finds the best point on the border of half-plane i, within the previous half-planes and the disc.
// Returns false if there is no such point.
bool solve_on_border(const std::vector<HalfPlane>& planes, std::size_t i, double radius,
                     const Objective& objective, Vec& point) {
  const HalfPlane& plane = planes[i];
  const double half_chord = radius * radius - plane.offset * plane.offset;
  if (half_chord < 0.0) return false;
  const Vec foot = plane.offset * plane.normal;
  const Vec along = left_of(plane.normal);
  double most = std::sqrt(half_chord);
  double least = -most;
  for (std::size_t j = 0; j < i; ++j) {
    const double slope = dot(planes[j].normal, along);
    const double missing = planes[j].offset - dot(planes[j].normal, foot);
    if (std::fabs(slope) <= kParallel) {
      if (missing > 0.0) return false;
    } else if (slope > 0.0) {
      least = std::max(least, missing / slope);
    } else {
      most = std::min(most, missing / slope);
    }
    if (least > most) return false;
  }
  const double wanted = dot(along, objective.aim);
  const double t = objective.is_direction ? (wanted > 0.0 ? most : least)
                                          : std::min(std::max(wanted, least), most);
  point = foot + t * along;
  return true;
}

// Finds the best point. Returns the number of half-planes that the point satisfies, counted from
// the first one up to the first half-plane that leaves no point.
std::size_t solve(const std::vector<HalfPlane>& planes, double radius, const Objective& objective,
                  Vec& point) {
  point = objective.is_direction ? radius * objective.aim : limited(objective.aim, radius);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (dot(planes[i].normal, point) >= planes[i].offset) continue;
    const Vec before = point;
    if (!solve_on_border(planes, i, radius, objective, point)) {
      point = before;
      return i;
    }
  }
  return planes.size();
}

}  // namespace

Vec nearest_point(const std::vector<HalfPlane>& planes, std::size_t hard, double radius,
                  Vec preferred) {
  Vec point;
  const std::size_t satisfied = solve(planes, radius, {preferred, false}, point);
  double violation = 0.0;
  std::vector<HalfPlane> bounds;
  for (std::size_t i = satisfied; i < planes.size(); ++i) {
    if (planes[i].offset - dot(planes[i].normal, point) <= violation) continue;
    // Half-plane i is violated most. Move the point along the normal until another half-plane is
    // violated as much.
    bounds.assign(planes.begin(), planes.begin() + static_cast<std::ptrdiff_t>(std::min(hard, i)));
    for (std::size_t j = hard; j < i; ++j) {
      const Vec normal = planes[j].normal - planes[i].normal;
      const double size = length(normal);
      if (size <= kParallel) continue;
      bounds.push_back({(1.0 / size) * normal, (planes[j].offset - planes[i].offset) / size});
    }
    const Vec before = point;
    if (solve(bounds, radius, {planes[i].normal, true}, point) < bounds.size()) point = before;
    violation = planes[i].offset - dot(planes[i].normal, point);
  }
  return point;
}

}  // namespace flatland::crowd
