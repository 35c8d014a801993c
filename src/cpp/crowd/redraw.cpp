// The first places of people: random free places from which there is a way to their waypoints.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "angles.h"
#include "crowd/crowd.h"
#include "crowd/random.h"
#include "world/bodies.h"
#include "world/world.h"

namespace flatland::crowd {
namespace {

// The streams of random numbers of first places and of first waypoints, to which the numbers of
// people and of parties are added.
constexpr std::uint64_t kPlaces = std::uint64_t{4} << 40U;
constexpr std::uint64_t kLegs = std::uint64_t{5} << 40U;

constexpr double kGap = 0.04;  // least distance from walls, bodies and other people [m]
constexpr std::uint64_t kMostTries = 20000;

}  // namespace

bool Crowd::is_free(const Spot& spot, const std::vector<Spot>& taken) const {
  const double reach = spot.radius + kGap;
  const auto is_apart = [&](const Spot& other) {
    return length(other.position - spot.position) >= reach + other.radius;
  };
  const auto is_off = [&](const Obstacle& obstacle) {
    Vec away;
    return length(obstacle.center - spot.position) >= reach + obstacle.radius ||
           obstacle.gap(spot.position, away) >= reach;
  };
  const auto& obstacles = surroundings_.obstacles();
  return surroundings_.walls().distance(spot.position, reach) >= reach &&
         std::all_of(taken.begin(), taken.end(), is_apart) &&
         std::all_of(obstacles.begin(), obstacles.end(), is_off);
}

// Draws a free place of person i.
bool Crowd::draw_spot(std::size_t i, const std::vector<Spot>& taken, Spot& spot) {
  const Person& person = people_[i];
  const Route& route = routes_[parties_[person.party].route];
  surroundings_.extend(person.radius + kGap);
  Vec low = route.low;
  Vec high = route.high;
  const Walls& walls = surroundings_.walls();
  if (!walls.empty()) {
    low = {std::max(low.x, walls.low().x), std::max(low.y, walls.low().y)};
    high = {std::min(high.x, walls.high().x), std::min(high.y, walls.high().y)};
  }
  const Vec size = high - low;
  if (!std::isfinite(size.x) || !std::isfinite(size.y)) return false;  // there are no walls
  const Way* way = way_of(route.waypoints.front());
  spot.radius = person.radius;
  for (std::uint64_t k = 0; k < kMostTries; ++k) {
    const auto draw = [&](std::uint64_t n) {
      return uniform(settings_.key, kPlaces + person.number, 2 * k + n);
    };
    spot.position = {low.x + draw(0) * size.x, low.y + draw(1) * size.y};
    const bool has_way =
        way == nullptr || square(way->field().direction(spot.position, walls)) > 0.0;
    if (has_way && is_free(spot, taken)) return true;
  }
  return false;
}

// Sorts the places of the people of a route, so that those who walk together are neighbours: the
// first member of each party is at the first place that is left, the others are at the nearest
// ones.
void Crowd::arrange(const std::vector<std::size_t>& people, std::vector<Spot>& spots) const {
  for (std::size_t k = 1; k < people.size(); ++k) {
    const std::uint32_t party = people_[people[k]].party;
    std::size_t first = k;
    while (first > 0 && people_[people[first - 1]].party == party) --first;
    if (first == k) continue;
    const Vec center = spots[first].position;
    const auto rest = spots.begin() + static_cast<std::ptrdiff_t>(k);
    std::iter_swap(rest, std::min_element(rest, spots.end(), [&](const Spot& a, const Spot& b) {
                     return square(a.position - center) < square(b.position - center);
                   }));
  }
}

// Places a person, who stands and begins the route.
void Crowd::begin_again(World& world, std::size_t i, Vec position) {
  Person& person = people_[i];
  Party& party = parties_[person.party];
  const auto draw = [&](std::uint64_t n) {
    return uniform(settings_.key, kPlaces + person.number, 2 * kMostTries + n);
  };
  person.heading = kTwoPi * draw(0) - kPi;
  person.phase = draw(1);
  person.position = position;
  person.velocity = person.acceleration = {};
  person.stop_until = person.yield_until = 0;
  person.delay = person.lost = 0.0;
  person.yields_to = kNone;
  for (auto& queue : queues_) {
    queue.erase(std::remove(queue.begin(), queue.end(), person.number), queue.end());
  }
  const Route& route = routes_[party.route];
  const auto count = static_cast<double>(route.waypoints.size());
  party.leg =
      route.order == Route::Order::kRandom
          ? static_cast<std::uint32_t>(count * uniform(settings_.key, kLegs + party.number, 0))
          : 0;
  party.is_backward = party.is_waiting = party.is_done = false;
  party.wait_until = party.since = 0;
  b2Body* body = world.find_body(person.body);
  set_pose(world, body, {position.x, position.y, person.heading});
  set_velocity(body, {});
  const Vec left = left_of({std::cos(person.heading), std::sin(person.heading)});
  for (int side = 0; side < 2; ++side) {
    b2Body* leg = world.find_body(person.legs[side]);
    if (leg == nullptr) continue;
    const Vec foot = position + (side == 0 ? 0.5 : -0.5) * settings_.leg_spacing * left;
    set_pose(world, leg, {foot.x, foot.y, person.heading});
    set_velocity(leg, {});
  }
}

Id Crowd::redraw(World& world) {
  read_people(world);
  read_surroundings(world);
  std::vector<Spot> taken;
  for (const Person& person : people_) {
    if (!person.is_redrawn) taken.push_back({person.position, person.radius});
  }
  std::vector<std::vector<std::size_t>> people(routes_.size());
  std::vector<std::vector<Spot>> spots(routes_.size());
  for (std::size_t i = 0; i < people_.size(); ++i) {
    if (!people_[i].is_redrawn) continue;
    Spot spot;
    if (!draw_spot(i, taken, spot)) return people_[i].body;
    taken.push_back(spot);
    const std::uint32_t route = parties_[people_[i].party].route;
    people[route].push_back(i);
    spots[route].push_back(spot);
  }
  for (std::size_t route = 0; route < routes_.size(); ++route) {
    arrange(people[route], spots[route]);
    for (std::size_t k = 0; k < people[route].size(); ++k) {
      begin_again(world, people[route][k], spots[route][k].position);
    }
  }
  signals_.clear();
  return 0;
}

}  // namespace flatland::crowd
