#include "crowd/social_force.h"

#include <algorithm>
#include <cmath>

namespace flatland::crowd {
namespace {

constexpr double kRightAngle = 1.5707963267948966;
// Both constants are those of the source: half of the field of view without turning the head [rad],
// and the least distance of two members of a group [m].
constexpr double kGroupView = kRightAngle;
constexpr double kGroupDistance = 0.8;
// The greatest length of the gradient of b in a repulsion; it has no bound next to the foci.
constexpr double kMostSlope = 3.0;

// Returns the distance over which an acceleration decreases to a negligible one, if it decreases by
// the factor e over a range [m].
double sight(double acceleration, double range) {
  return range * std::log(std::max(acceleration / kNegligible, 1.0));
}

}  // namespace

void SocialForces::derive() {
  person_sight = sight(kMostSlope * strength / range, range);
  wall_sight = sight(wall_strength, wall_range);
  view_cosine = std::cos(half_view);
}

Vec driving_acceleration(const SocialForces& forces, Vec preferred, Vec velocity) {
  return (1.0 / forces.relaxation_time) * (preferred - velocity);
}

Vec repulsion(const SocialForces& forces, Vec offset, Vec other_velocity) {
  // The potential is V0 exp(-b / sigma); b is the semi-minor axis of the ellipse with the foci at
  // the other person and at its position after `look_ahead`.
  const Vec step = forces.look_ahead * other_velocity;
  const Vec later = offset - step;
  const double here = length(offset);
  const double there = length(later);
  const double sum = here + there;
  constexpr double kLeast = 1e-3;  // least b [m]; on the line between the foci, b would be 0
  const double b = std::max(0.5 * std::sqrt(std::max(sum * sum - square(step), 0.0)), kLeast);
  if (b > forces.person_sight) return {};
  const double size = forces.strength / forces.range * std::exp(-b / forces.range);
  const Vec slope = sum / (4.0 * b) * (unit(offset, {1.0, 0.0}) + unit(later));
  return size * limited(slope, kMostSlope);
}

double view_weight(const SocialForces& forces, Vec heading, Vec push) {
  const double along = -dot(heading, push);
  return along >= length(push) * forces.view_cosine ? 1.0 : forces.behind;
}

Vec wall_repulsion(const SocialForces& forces, Vec offset, double radius) {
  const double gap = length(offset) - radius;
  return forces.wall_strength * std::exp(-std::max(gap, 0.0) / forces.wall_range) * unit(offset);
}

Vec group_attraction(const SocialForces& forces, int size, Vec heading, Vec velocity,
                     Vec to_center) {
  Vec sum;
  const double angle = std::fabs(std::atan2(cross(heading, to_center), dot(heading, to_center)));
  // A person who must turn the head to see the others walks more slowly.
  if (angle > kGroupView) sum -= forces.gaze * (angle - kGroupView) * velocity;
  if (length(to_center) > 0.5 * (size - 1)) sum += forces.cohesion * unit(to_center);
  return sum;
}

Vec group_repulsion(const SocialForces& forces, Vec offset) {
  return length(offset) < kGroupDistance ? forces.spacing * unit(offset, {1.0, 0.0}) : Vec{};
}

}  // namespace flatland::crowd
