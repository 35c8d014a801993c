// How people who block each other give way.
//
// A person without progress (the root of a request) asks the people in front to make room, and
// these people ask the people behind them. The scheme is a continuous form of priority inheritance:
// K. Okumura, M. Machida, X. Défago and Y. Tamura, "Priority inheritance with backtracking for
// iterative multi-agent path finding", Artificial Intelligence 310 (2022). As in this source, the
// priority of a person grows with the time since the last waypoint, so that every person has the
// highest priority eventually.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "crowd/crowd.h"

namespace flatland::crowd {
namespace {

constexpr double kSlow = 0.2;       // share of the preferred speed below which there is no progress
constexpr double kPatience = 0.5;   // delay from which a person asks idle people for room [s]
constexpr double kStuck = 2.0;      // delay from which a person also asks walking people [s]
constexpr double kMostDelay = 3.0;  // greatest delay that is counted [s]
constexpr double kRecovery = 4.0;   // decrease of the delay per second of progress [s/s]
constexpr double kHold = 1.5;       // time for which people make room [s]
constexpr double kReach = 0.4;      // greatest gap to a person who is asked [m]
constexpr double kMargin = 0.1;     // additional half width of the lane to be freed [m]
constexpr double kSameWay = 0.5;    // cosine of the angle between ways that count as equal
constexpr double kSideways = 0.7;   // sideways part of the motion that makes room
constexpr double kStraight =
    0.05;  // offset to the right up to which a person makes room to the left [m]

}  // namespace

bool Crowd::precedes(const Person& a, const Person& b) const {
  const std::int64_t since_a = parties_[a.party].since;
  const std::int64_t since_b = parties_[b.party].since;
  return since_a != since_b ? since_a < since_b : a.number < b.number;
}

Crowd::Stance Crowd::stance_of(const Person& person, const Choice& choice) const {
  if (person.is_stopped || person.stop_until != 0 || is_queued(person)) return Stance::kFixed;
  return square(choice.velocity) > 0.0 && !choice.is_held ? Stance::kWalking : Stance::kIdle;
}

void Crowd::give_way(std::vector<Choice>& choices, std::int64_t step, double dt, double period) {
  stances_.resize(people_.size());
  std::vector<std::size_t> blocked;
  for (std::size_t i = 0; i < people_.size(); ++i) {
    Person& person = people_[i];
    stances_[i] = stance_of(person, choices[i]);
    const bool is_walking = stances_[i] == Stance::kWalking;
    const bool is_slow =
        is_walking && dot(person.velocity, choices[i].direction) < kSlow * person.speed;
    person.delay = std::min(std::max(person.delay + (is_slow ? period : -kRecovery * period), 0.0),
                            kMostDelay);
    if (is_slow || choices[i].is_held) person.lost += period;
    if (is_walking && person.delay > kPatience) blocked.push_back(i);
  }
  std::sort(blocked.begin(), blocked.end(),
            [this](std::size_t a, std::size_t b) { return precedes(people_[a], people_[b]); });
  const auto until = step + static_cast<std::int64_t>(std::ceil(kHold / dt));
  std::vector<bool> is_asked(people_.size());
  for (const std::size_t i : blocked) {
    if (!is_asked[i]) ask_for_room(i, choices, is_asked, until);
  }
  for (std::size_t i = 0; i < people_.size(); ++i) {
    Person& person = people_[i];
    if (person.yields_to == kNone) continue;
    const Person* other = numbered(person.yields_to);
    const bool is_over =
        other == nullptr || step >= person.yield_until || stances_[i] == Stance::kFixed;
    if (is_over) {
      person.yields_to = kNone;
      person.yield_until = 0;
      continue;
    }
    // The person walks ahead of the other person and out of the lane. Near the axis of the lane,
    // the side is the left one as seen by the other person.
    const Vec way = way_to(target_of(*other), person.position);
    const double aside = cross(way, person.position - other->position);
    const double sign = aside > -kStraight ? 1.0 : -1.0;
    const Vec direction = unit(way + sign * kSideways * left_of(way));
    choices[i] = {person.speed * direction, direction};
  }
}

void Crowd::ask_for_room(std::size_t root, const std::vector<Choice>& choices,
                         std::vector<bool>& is_asked, std::int64_t until) {
  const Person& first = people_[root];
  const std::uint32_t target = target_of(first);
  std::vector<std::size_t> asking{root};
  is_asked[root] = true;
  while (!asking.empty()) {
    const std::size_t i = asking.back();
    asking.pop_back();
    const Person& person = people_[i];
    const Vec way = i == root ? choices[i].direction : way_to(target, person.position);
    for (std::uint32_t k = neighbour_starts_[i]; k < neighbour_starts_[i + 1]; ++k) {
      const std::size_t j = neighbours_[k];
      Person& other = people_[j];
      if (is_asked[j] || stances_[j] == Stance::kFixed) continue;
      const bool is_walking = stances_[j] == Stance::kWalking;
      if (is_walking && (first.delay < kStuck || !precedes(first, other))) continue;
      const Vec offset = other.position - person.position;
      const double reach = person.radius + other.radius;
      if (dot(offset, way) <= 0.0 || std::fabs(cross(way, offset)) > reach + kMargin) continue;
      if (length(offset) > reach + kReach) continue;
      if (!see_each_other(i, j)) continue;
      is_asked[j] = true;
      asking.push_back(j);
      const double cosine = dot(choices[j].direction, way_to(target, other.position));
      // Person j walks the same way, and is blocked by the same people.
      if ((is_walking || choices[j].is_held) && cosine > kSameWay) continue;
      other.yields_to = first.number;
      other.yield_until = until;
    }
  }
}

}  // namespace flatland::crowd
