// How people pass doors and each other. People pass a door in one direction at a time, and wait
// beside the door for the other direction. Elsewhere, people keep right of oncoming people.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "crowd/crowd.h"

namespace flatland::crowd {
namespace {

constexpr double kApproach = 4.0;    // distance within which people approach a door [m]
constexpr double kAhead = 0.5;       // least cosine of the angle between the way and the door
constexpr double kThrough = 0.3;     // least cosine of the angle between the way and the axis
constexpr double kThreshold = 0.35;  // space on both sides that belongs to the passage [m]
constexpr double kLane = 0.25;       // additional width of a lane on each side of the door [m]
constexpr double kWait = 1.2;        // distance from the passage at which people wait [m]
constexpr double kRetreat = 0.8;     // distance from the passage below which people step back [m]
constexpr double kAside = 0.6;       // share of the preferred speed with which people step aside

constexpr double kView = 3.0;      // distance within which people are oncoming [m]
constexpr double kLeft = 0.8;      // distance to the left of the way for the same [m]
constexpr double kRight = 1.5;     // distance to the right of the way for the same [m]
constexpr double kOpposed = -0.5;  // greatest cosine of the angle between opposite ways
constexpr double kMostTurn = 0.5;  // tangent of the greatest angle by which people turn right

}  // namespace

bool Crowd::approaches(std::size_t i, const Choice& choice, std::size_t gate, Approach& approach) {
  const Person& person = people_[i];
  const Gate& g = ways_->gates()[gate];
  const Vec offset = person.position - g.center;
  const double along = dot(offset, g.axis);
  const bool is_inside = std::fabs(along) < g.half_depth + kThreshold &&
                         std::fabs(cross(g.axis, offset)) < g.half_width;
  const bool is_ahead = dot(choice.direction, -offset) > kAhead * length(offset);
  if (!is_inside && !is_ahead) return false;
  // The way is taken at the center: next to a door post, the way may lead in any direction.
  const double cosine = dot(way_of(target_of(person))->from_gate(gate), g.axis);
  if (std::fabs(cosine) < kThrough) return false;
  approach = {i, gate, cosine > 0.0 ? 1 : 0, is_inside};
  if (is_inside) return true;
  return cosine * along < 0.0 && surroundings_.walls().is_clear(person.position, g.center);
}

Crowd::Choice Crowd::step_aside(const Person& person, const Choice& choice,
                                const Approach& approach) const {
  const Gate& gate = ways_->gates()[approach.gate];
  const Vec ahead = approach.direction == 1 ? gate.axis : -gate.axis;
  const Vec offset = person.position - gate.center;
  const double distance = -dot(offset, ahead) - gate.half_depth;
  const double across = cross(ahead, offset);
  const bool is_in_lane = std::fabs(across) < gate.half_width + kLane;
  if (is_in_lane) {
    const Vec aside = (across > 0.0 ? 1.0 : -1.0) * left_of(ahead);
    const Vec back = distance < kRetreat ? -ahead : Vec{};
    return {kAside * person.speed * unit(aside + 0.5 * back), choice.direction, true};
  }
  return {distance > kWait ? choice.velocity : Vec{}, choice.direction, true};
}

void Crowd::keep_doors_clear(std::vector<Choice>& choices, std::int64_t step, double dt) {
  if (ways_ == nullptr || ways_->gates().empty()) return;
  const std::vector<Gate>& gates = ways_->gates();
  std::vector<Demand> demands(gates.size());
  for (Demand& demand : demands) {
    for (double& nearest : demand.nearest) nearest = std::numeric_limits<double>::infinity();
  }
  std::vector<Approach> approaching;
  for (std::size_t i = 0; i < people_.size(); ++i) {
    if (stance_of(people_[i], choices[i]) != Stance::kWalking) continue;
    const double x = people_[i].position.x;
    const auto first =
        std::lower_bound(gates.begin(), gates.end(), x - kApproach,
                         [](const Gate& gate, double least) { return gate.center.x < least; });
    for (auto gate = first; gate != gates.end() && gate->center.x <= x + kApproach; ++gate) {
      if (square(people_[i].position - gate->center) > kApproach * kApproach) continue;
      Approach approach;
      const auto index = static_cast<std::size_t>(gate - gates.begin());
      if (!approaches(i, choices[i], index, approach)) continue;
      approaching.push_back(approach);
      Demand& demand = demands[index];
      if (approach.is_inside) {
        ++demand.inside[approach.direction];
      } else {
        ++demand.waiting[approach.direction];
        demand.nearest[approach.direction] = std::min(demand.nearest[approach.direction],
                                                      length(people_[i].position - gate->center));
      }
    }
  }
  for (std::size_t k = 0; k < gates.size(); ++k) signals_[k].update(demands[k], step, dt);
  for (const Approach& approach : approaching) {
    const Signal& signal = signals_[approach.gate];
    const bool is_open =
        signal.direction == approach.direction && (approach.is_inside || !signal.is_closing);
    if (is_open || choices[approach.person].is_held) continue;
    choices[approach.person] =
        step_aside(people_[approach.person], choices[approach.person], approach);
  }
}

bool Crowd::comes_towards(const Person& person, Vec way, std::size_t j, const Choice& choice,
                          double& ahead) const {
  if (dot(choice.direction, way) > kOpposed || square(choice.velocity) == 0.0) return false;
  // People with the same target can walk in opposite directions only at its door.
  if (target_of(people_[j]) == target_of(person)) return false;
  const Vec offset = people_[j].position - person.position;
  ahead = dot(offset, way);
  const double left = cross(way, offset);
  return ahead > 0.0 && ahead < kView && left < kLeft && left > -kRight &&
         surroundings_.walls().is_clear(person.position, people_[j].position);
}

void Crowd::keep_right(std::vector<Choice>& choices) const {
  std::vector<Vec> turned(people_.size());
  for (std::size_t i = 0; i < people_.size(); ++i) {
    const Vec way = choices[i].direction;
    turned[i] = choices[i].velocity;
    if (square(turned[i]) == 0.0 || choices[i].is_held) continue;
    double nearest = kView;
    for (std::uint32_t k = neighbour_starts_[i]; k < neighbour_starts_[i + 1]; ++k) {
      const std::size_t j = neighbours_[k];
      double ahead = kView;
      if (comes_towards(people_[i], way, j, choices[j], ahead)) nearest = std::min(nearest, ahead);
    }
    if (nearest == kView) continue;
    const double turn = kMostTurn * std::sqrt(1.0 - nearest / kView);
    turned[i] = people_[i].speed * unit(way - turn * left_of(way));
  }
  for (std::size_t i = 0; i < people_.size(); ++i) choices[i].velocity = turned[i];
}

}  // namespace flatland::crowd
