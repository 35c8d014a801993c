#include "crowd/orca.h"

#include <cmath>

namespace flatland::crowd {
namespace {

// Returns the change from a relative velocity to the nearest velocity outside a disc of velocities,
// and sets `normal` to the direction of the change.
Vec out_of_disc(Vec velocity, Vec center, double radius, Vec fallback, Vec& normal) {
  const Vec from_center = velocity - center;
  normal = unit(from_center, fallback);
  return (radius - length(from_center)) * normal;
}

}  // namespace

HalfPlane avoid(const Disc& disc, const Disc& other, double horizon, double share, double dt) {
  const Vec offset = other.position - disc.position;
  const Vec velocity = disc.velocity - other.velocity;
  const double radius = disc.radius + other.radius;
  const double distance2 = square(offset);
  const Vec fallback = unit(-offset, {1.0, 0.0});
  Vec normal;
  Vec change;
  if (distance2 <= radius * radius) {
    change = out_of_disc(velocity, (1.0 / dt) * offset, radius / dt, fallback, normal);
  } else {
    // The velocity obstacle is a cone whose apex is cut off by a disc.
    const Vec center = (1.0 / horizon) * offset;
    const Vec from_center = velocity - center;
    const double along = dot(from_center, offset);
    if (along < 0.0 && along * along > radius * radius * square(from_center)) {
      change = out_of_disc(velocity, center, radius / horizon, fallback, normal);
    } else {
      const double tangent = std::sqrt(distance2 - radius * radius);
      const bool is_left = cross(offset, from_center) > 0.0;
      const double sign = is_left ? 1.0 : -1.0;
      const Vec side = (1.0 / distance2) * (tangent * offset + sign * radius * left_of(offset));
      normal = sign * left_of(side);
      change = dot(velocity, side) * side - velocity;
    }
  }
  return {normal, dot(normal, disc.velocity + share * change)};
}

HalfPlane keep_off(Vec away, double gap, Vec obstacle_velocity, double horizon) {
  return {away, dot(away, obstacle_velocity) - gap / horizon};
}

}  // namespace flatland::crowd
