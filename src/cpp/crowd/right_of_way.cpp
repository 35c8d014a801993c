// How people pass doors and each other. People pass a door in one direction at a time, and wait
// beside the door for the other direction. Elsewhere, people keep right of oncoming people.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "crowd/crowd.h"

namespace flatland::crowd {
namespace {

constexpr double kAhead = 0.5;    // least cosine of the angle between the way and the door
constexpr double kLane = 0.25;    // additional width of a lane on each side of the door [m]
constexpr double kWait = 1.2;     // distance from the passage at which people wait [m]
constexpr double kRetreat = 0.8;  // distance from the passage below which people step back [m]
constexpr double kAside = 0.6;    // share of the preferred speed with which people step aside

constexpr double kView = 3.0;      // distance within which people are oncoming [m]
constexpr double kLeft = 0.8;      // distance to the left of the way for the same [m]
constexpr double kRight = 1.5;     // distance to the right of the way for the same [m]
constexpr double kOpposed = -0.5;  // greatest cosine of the angle between opposite ways
constexpr double kMostTurn = 0.5;  // tangent of the greatest angle by which people turn right

}  // namespace

// Appends the doors that person i approaches or passes to `approaching_`.
void Crowd::find_approaches(std::size_t i, const Choice& choice) {
  const Person& person = people_[i];
  const Way& way = *way_of(target_of(person));
  const std::vector<Gate>& gates = ways_->gates();
  const auto is_ahead = [&](const Gate& gate, int direction, Vec offset, double distance2) {
    // The direction of the passage, 1 or -1. A comparison of it would be a branch.
    const double sign = 2.0 * direction - 1.0;
    const double ahead = -dot(choice.direction, offset);
    return (sign * dot(offset, gate.axis) < 0.0) &
           (ahead * std::fabs(ahead) > kAhead * kAhead * distance2);
  };
  // Without branches, as in Walls::find_near: the next door replaces one that is not approached.
  const auto select = [&](SegmentGrid::Indices near, std::uint32_t* end) {
    for (const std::uint32_t k : near) {
      const Gate& gate = gates[k];
      const int direction = way.through(k);
      const Vec offset = person.position - gate.center;
      const double distance2 = square(offset);
      const bool is_near = distance2 <= kGateReach * kGateReach;
      const bool is_passed = direction != Way::kNoPassage;
      const bool may_be_inside = distance2 < gate.radius2;
      *end = k;
      end += static_cast<std::ptrdiff_t>(
          is_passed & is_near & (is_ahead(gate, direction, offset, distance2) | may_be_inside));
    }
    return end;
  };
  const SegmentGrid::Indices in_view = ways_->gates_in_view(person.position);
  const SegmentGrid::Indices others = ways_->other_gates(person.position);
  gates_.resize(in_view.size() + others.size());
  std::uint32_t* const end_in_view = select(in_view, gates_.data());
  std::uint32_t* const end = select(others, end_in_view);
  for (const std::uint32_t* k = gates_.data(); k != end; ++k) {
    const Gate& gate = gates[*k];
    const int direction = way.through(*k);
    const Vec offset = person.position - gate.center;
    const double distance2 = square(offset);
    const bool is_inside = gate.contains(offset);
    if (is_inside ||
        (is_ahead(gate, direction, offset, distance2) &&
         (k < end_in_view || surroundings_.walls().is_clear(person.position, gate.center)))) {
      approaching_.push_back({i, *k, direction, is_inside, std::sqrt(distance2)});
    }
  }
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

Signal Crowd::signal_of(std::uint32_t gate) const {
  const auto found = std::lower_bound(
      signals_.begin(), signals_.end(), gate,
      [](const Signal& signal, std::uint32_t index) { return signal.gate < index; });
  return found != signals_.end() && found->gate == gate ? *found : Signal{gate};
}

void Crowd::update_signals(std::int64_t step, double dt) {
  std::sort(approaching_.begin(), approaching_.end(),
            [](const Approach& a, const Approach& b) { return a.gate < b.gate; });
  next_signals_.clear();
  for (auto each = approaching_.begin(); each != approaching_.end();) {
    Signal signal = signal_of(each->gate);
    Demand demand;
    for (; each != approaching_.end() && each->gate == signal.gate; ++each) {
      const int direction = each->direction;
      if (each->is_inside) {
        ++demand.inside[direction];
      } else {
        ++demand.waiting[direction];
        demand.nearest[direction] = std::min(demand.nearest[direction], each->distance);
      }
    }
    signal.update(demand, step, dt);
    next_signals_.push_back(signal);
  }
  std::swap(signals_, next_signals_);
}

void Crowd::keep_doors_clear(std::vector<Choice>& choices, std::int64_t step, double dt) {
  if (ways_ == nullptr || ways_->gates().empty()) return;
  approaching_.clear();
  for (std::size_t i = 0; i < people_.size(); ++i) {
    if (stance_of(people_[i], choices[i]) != Stance::kWalking) continue;
    find_approaches(i, choices[i]);
  }
  update_signals(step, dt);
  for (const Approach& approach : approaching_) {
    const Signal signal = signal_of(approach.gate);
    const bool is_open =
        signal.direction == approach.direction && (approach.is_inside || !signal.is_closing);
    if (is_open || choices[approach.person].is_held) continue;
    choices[approach.person] =
        step_aside(people_[approach.person], choices[approach.person], approach);
  }
}

bool Crowd::comes_towards(std::size_t i, Vec way, std::size_t j, const Choice& choice,
                          double& ahead) const {
  const Person& person = people_[i];
  if (dot(choice.direction, way) > kOpposed || square(choice.velocity) == 0.0) return false;
  // People with the same target can walk in opposite directions only at its door.
  if (target_of(people_[j]) == target_of(person)) return false;
  const Vec offset = people_[j].position - person.position;
  ahead = dot(offset, way);
  const double left = cross(way, offset);
  return ahead > 0.0 && ahead < kView && left < kLeft && left > -kRight && see_each_other(i, j);
}

void Crowd::keep_right(std::vector<Choice>& choices) const {
  for (std::size_t i = 0; i < people_.size(); ++i) {
    const Vec way = choices[i].direction;
    if (square(choices[i].velocity) == 0.0 || choices[i].is_held) continue;
    double nearest = kView;
    for (std::uint32_t k = neighbour_starts_[i]; k < neighbour_starts_[i + 1]; ++k) {
      const std::size_t j = neighbours_[k];
      double ahead = kView;
      if (comes_towards(i, way, j, choices[j], ahead)) nearest = std::min(nearest, ahead);
    }
    if (nearest == kView) continue;
    const double turn = kMostTurn * std::sqrt(1.0 - nearest / kView);
    // Neither the direction of the way nor whether the velocity is zero changes, on which the
    // turns of others depend.
    choices[i].velocity = people_[i].speed * unit(way - turn * left_of(way));
  }
}

}  // namespace flatland::crowd
