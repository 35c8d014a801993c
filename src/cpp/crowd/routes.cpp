// Where people want to walk: to waypoints, with waiting times, queues and stops.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "angles.h"
#include "crowd/crowd.h"
#include "crowd/random.h"

namespace flatland::crowd {
namespace {

// The streams of random numbers of people and of parties, to which their numbers are added.
constexpr std::uint64_t kStops = std::uint64_t{1} << 40U;
constexpr std::uint64_t kParties = std::uint64_t{2} << 40U;

constexpr double kRoom = 0.5;     // area that each person needs at a waypoint [m²]
constexpr double kGiveUp = 8.0;   // time without progress until people who wander turn away [s]
constexpr double kCrowded = 4.0;  // greatest distance at which a crowded place is reached [m]
constexpr double kArrival = 0.7;  // time constant of the approach to a point in a queue [s]
constexpr double kNearPoint =
    0.1;                          // distance to a point in a queue at which people stand still [m]
constexpr double kCounter = 0.3;  // distance to the head of a queue at which waiting begins [m]

// Returns the distance from a place within which there is room for `count` people.
double room_for(const Place& place, std::uint32_t count) {
  const Vec size = place.high - place.low;
  const double half_girth = size.x + size.y;
  const double missing = kRoom * count - size.x * size.y;
  if (missing <= 0.0) return 0.0;
  return (std::sqrt(half_girth * half_girth + kPi * missing) - half_girth) / kPi;
}

std::int64_t steps(double seconds, double dt) {
  return static_cast<std::int64_t>(std::ceil(seconds / dt));
}

}  // namespace

void Crowd::count_guests() {
  guests_.assign(waypoints_.size(), 0);
  for (const Person& person : people_) {
    const Party& party = parties_[person.party];
    const bool is_guest =
        person.sent_to != kNone ? person.is_stopped : party.is_waiting || party.is_done;
    if (!is_guest) continue;
    ++guests_[target_of(person)];
  }
}

bool Crowd::has_arrived(const Person& person, std::uint32_t waypoint) const {
  const Place& place = waypoints_[waypoint].place;
  const Vec nearest = place.nearest(person.position);
  const double distance = length(nearest - person.position);
  double reach = std::max(place.radius, room_for(place, guests_[waypoint] + 1));
  // In a crowd, people who are nearer to the place need room as well.
  if (distance > reach && distance < kCrowded && person.delay > 0.0) {
    const auto is_nearer = [&](const Person& other) {
      return square(place.nearest(other.position) - other.position) < distance * distance;
    };
    const auto nearer = std::count_if(people_.begin(), people_.end(), is_nearer);
    reach = std::max(reach, room_for(place, static_cast<std::uint32_t>(nearer) + 1));
  }
  return distance <= reach && surroundings_.walls().is_clear(person.position, nearest);
}

Crowd::Choice Crowd::approach(const Person& person, std::uint32_t waypoint) {
  const Vec way = way_to(waypoint, person.position);
  return {person.speed * way, way};
}

void Crowd::arrive(Party& party, std::uint32_t waypoint, std::int64_t step, double dt) {
  const Span wait = waypoints_[waypoint].wait;
  if (wait.most <= 0.0) {
    leave(party, waypoint, step);
    return;
  }
  const std::uint64_t stream = kParties + party.number;
  party.is_waiting = true;
  party.wait_until = step + steps(draw(party.draws, stream, wait), dt);
}

void Crowd::leave(Party& party, std::uint32_t waypoint, std::int64_t step) {
  party.is_waiting = false;
  party.since = step;
  for (const std::uint32_t i : party.members) {
    Person& person = people_[i];
    person.lost = 0.0;
    auto& queue = queues_[waypoint];
    queue.erase(std::remove(queue.begin(), queue.end(), person.number), queue.end());
  }
  const Route& route = routes_[party.route];
  const auto count = static_cast<std::uint32_t>(route.waypoints.size());
  switch (route.order) {
    case Route::Order::kLoop:
      party.leg = (party.leg + 1) % count;
      break;
    case Route::Order::kOnce:
      party.is_done = party.leg + 1 == count;
      if (!party.is_done) ++party.leg;
      break;
    case Route::Order::kBackAndForth:
      if (count == 1) break;
      if (party.is_backward ? party.leg == 0 : party.leg + 1 == count) {
        party.is_backward = !party.is_backward;
      }
      party.leg = party.is_backward ? party.leg - 1 : party.leg + 1;
      break;
    case Route::Order::kRandom: {
      if (count == 1) break;
      // All other waypoints have the same probability.
      const std::uint64_t stream = kParties + party.number;
      const auto skip =
          static_cast<std::uint32_t>(draw(party.draws, stream, {1.0, static_cast<double>(count)}));
      party.leg = (party.leg + std::min(skip, count - 1)) % count;
      break;
    }
  }
}

Crowd::Choice Crowd::queue_up(Person& person, Party& party, std::uint32_t waypoint,
                              std::int64_t step, double dt) {
  auto& queue = queues_[waypoint];
  const double spacing = waypoints_[waypoint].spacing;
  const auto place = std::find(queue.begin(), queue.end(), person.number);
  if (place == queue.end()) {
    const Vec tail = queue.empty() ? waypoints_[waypoint].place.nearest(person.position)
                                   : numbered(queue.back())->position;
    const double reach = std::max(2.0 * spacing, waypoints_[waypoint].place.radius);
    if (length(tail - person.position) < reach &&
        surroundings_.walls().is_clear(person.position, tail)) {
      queue.push_back(person.number);
    }
    return approach(person, waypoint);
  }
  Vec goal = waypoints_[waypoint].place.nearest(person.position);
  if (place == queue.begin()) {
    if (!party.is_waiting && length(goal - person.position) < kCounter) {
      arrive(party, waypoint, step, dt);
    }
  } else {
    const Vec ahead = numbered(*(place - 1))->position;
    goal = ahead + spacing * unit(person.position - ahead);
  }
  const Vec remaining = goal - person.position;
  const Vec way = unit(waypoints_[waypoint].place.nearest(person.position) - person.position);
  if (length(remaining) < kNearPoint) return {{}, way};
  return {limited((1.0 / kArrival) * remaining, person.speed), way};
}

Crowd::Choice Crowd::choose(Person& person, std::int64_t step, double dt, double period) {
  Party& party = parties_[person.party];
  const auto stand = [&]() -> Choice {
    return {{}, {std::cos(person.heading), std::sin(person.heading)}};
  };
  if (party.is_waiting && step >= party.wait_until) {
    leave(party, routes_[party.route].waypoints[party.leg], step);
  }
  if (person.is_stopped) return stand();
  if (person.sent_to != kNone) {
    if (!has_arrived(person, person.sent_to)) return approach(person, person.sent_to);
    person.is_stopped = true;
    return stand();
  }
  const Route& route = routes_[party.route];
  if (person.stop_until != 0) {
    if (step < person.stop_until) return stand();
    person.stop_until = 0;
  } else if (route.stop_interval > 0.0 && !party.is_waiting && !party.is_done) {
    const std::uint64_t stream = kStops + person.number;
    if (draw(person.draws, stream, {0.0, 1.0}) < period / route.stop_interval) {
      person.stop_until = step + steps(draw(person.draws, stream, route.stop), dt);
      return stand();
    }
  }
  // A person who wanders without progress turns to another place.
  if (route.order == Route::Order::kRandom && person.lost > kGiveUp) {
    leave(party, route.waypoints[party.leg], step);
  }
  const std::uint32_t waypoint = route.waypoints[party.leg];
  if (party.is_done) {
    return has_arrived(person, waypoint) ? stand() : approach(person, waypoint);
  }
  if (waypoints_[waypoint].is_queue) return queue_up(person, party, waypoint, step, dt);
  if (has_arrived(person, waypoint)) {
    if (!party.is_waiting) arrive(party, waypoint, step, dt);
    if (party.is_waiting || party.is_done) return stand();
    return approach(person, route.waypoints[party.leg]);
  }
  return approach(person, waypoint);
}

}  // namespace flatland::crowd
