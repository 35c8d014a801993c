// How people move: the velocity by the model of the crowd, the nearest velocity without contacts,
// and the motion of the legs.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "angles.h"
#include "crowd/crowd.h"
#include "crowd/gait.h"
#include "crowd/orca.h"
#include "crowd/random.h"
#include "world/bodies.h"
#include "world/world.h"

namespace flatland::crowd {
namespace {

// The streams of random numbers of the fluctuations, to which the number of a person is added.
constexpr std::uint64_t kFluctuations = std::uint64_t{3} << 40U;

constexpr double kSkin = 2e-4;              // gap that covers the rounding of single precision [m]
constexpr double kParting = 0.5;            // greatest speed at which overlaps are resolved [m/s]
constexpr double kRounding = 1e-6;          // bound of the rounding error of velocities [m/s]
constexpr double kMostSpeed = 1.3;          // greatest speed as a multiple of the preferred speed
constexpr double kMostAcceleration = 20.0;  // greatest acceleration of a dynamic body [m/s²]
constexpr double kTurning = 0.2;            // time constant of the heading [s]
constexpr double kStanding = 0.05;          // speed below which the heading remains [m/s]

double normalized(double angle) {
  return std::fabs(angle) <= kPi ? angle : std::remainder(angle, kTwoPi);
}

double most_speed(const Person& person) { return std::max(kMostSpeed * person.speed, 0.5); }

// Returns the least speed along the normal of a half-plane for which a gap remains after a period;
// positive if the gap is negative and must open.
double closing_offset(double gap, double period) {
  return std::min((kSkin - gap) / period, kParting);
}

}  // namespace

void Crowd::find_neighbours() {
  const auto count = static_cast<std::uint32_t>(people_.size());
  if (sorted_.size() != count) {
    sorted_.resize(count);
    std::iota(sorted_.begin(), sorted_.end(), 0U);
  }
  std::sort(sorted_.begin(), sorted_.end(), [&](std::uint32_t a, std::uint32_t b) {
    const double xa = people_[a].position.x;
    const double xb = people_[b].position.x;
    return xa != xb ? xa < xb : a < b;
  });
  const double sight2 = settings_.sight * settings_.sight;
  pairs_.clear();
  for (std::uint32_t s = 0; s < count; ++s) {
    const Vec p = people_[sorted_[s]].position;
    for (std::uint32_t t = s + 1; t < count; ++t) {
      const Vec offset = people_[sorted_[t]].position - p;
      if (offset.x > settings_.sight) break;
      if (square(offset) < sight2) pairs_.emplace_back(sorted_[s], sorted_[t]);
    }
  }
  neighbour_starts_.assign(count + 1, 0);
  for (const auto& [a, b] : pairs_) {
    ++neighbour_starts_[a + 1];
    ++neighbour_starts_[b + 1];
  }
  std::partial_sum(neighbour_starts_.begin(), neighbour_starts_.end(), neighbour_starts_.begin());
  neighbours_.resize(2 * pairs_.size());
  pushes_.resize(neighbours_.size());
  next_.assign(neighbour_starts_.begin(), neighbour_starts_.end() - 1);
  for (const auto& [a, b] : pairs_) {
    const std::uint32_t place_of_b = next_[a]++;
    const std::uint32_t place_of_a = next_[b]++;
    neighbours_[place_of_b] = b;
    neighbours_[place_of_a] = a;
    if (settings_.model == Settings::Model::kSocialForce) find_pushes(a, place_of_b, b, place_of_a);
  }
}

bool Crowd::see_each_other(std::size_t i, std::size_t j) const {
  const Vec offset = people_[j].position - people_[i].position;
  const double clearance = clearances_[i] + clearances_[j];
  // If the discs without walls overlap, they contain the line between their centers.
  return square(offset) < clearance * clearance ||
         surroundings_.walls().is_clear(people_[i].position, people_[j].position);
}

void Crowd::find_pushes(std::uint32_t a, std::uint32_t place_of_b, std::uint32_t b,
                        std::uint32_t place_of_a) {
  const SocialForces& forces = settings_.forces;
  const Person& one = people_[a];
  const Person& other = people_[b];
  const Vec offset = one.position - other.position;
  Vec push = repulsion(forces, offset, other.velocity - forces.relative * one.velocity);
  // Opposite arguments have opposite results, except at the same place.
  const bool is_opposite = forces.relative == 1.0 && square(offset) > 1e-18;
  Vec opposite = is_opposite
                     ? -push
                     : repulsion(forces, -offset, one.velocity - forces.relative * other.velocity);
  const bool is_negligible = std::max(square(push), square(opposite)) < kNegligible * kNegligible;
  if (is_negligible || !see_each_other(a, b)) push = opposite = {};
  pushes_[place_of_b] = push;
  pushes_[place_of_a] = opposite;
}

double Crowd::wall_sight(const Person& person) const {
  return settings_.model == Settings::Model::kOrca ? settings_.wall_horizon * most_speed(person)
                                                   : settings_.forces.wall_sight;
}

double Crowd::wall_range(const Person& person, double period) const {
  return person.radius + std::max(wall_sight(person), kSkin + most_speed(person) * period);
}

void Crowd::find_walls(double period) {
  near_walls_.clear();
  near_wall_starts_.clear();
  clearances_.clear();
  for (const Person& person : people_) {
    const std::size_t first = near_walls_.size();
    near_wall_starts_.push_back(static_cast<std::uint32_t>(first));
    double clearance = wall_range(person, period);
    surroundings_.extend(clearance);
    surroundings_.walls().find_near(person.position, clearance, near_walls_);
    for (std::size_t i = first; i < near_walls_.size(); ++i) {
      clearance = std::min(clearance, near_walls_[i].distance);
    }
    clearances_.push_back(clearance);
  }
  near_wall_starts_.push_back(static_cast<std::uint32_t>(near_walls_.size()));
}

void Crowd::add_walls(std::size_t i, double range, std::vector<NearPoint>& found) const {
  for (std::uint32_t k = near_wall_starts_[i]; k < near_wall_starts_[i + 1]; ++k) {
    if (near_walls_[k].distance <= range) found.push_back(near_walls_[k]);
  }
}

Vec Crowd::by_social_force(std::size_t i, const Choice& choice, Vec preferred, double period) {
  const Person& person = people_[i];
  const SocialForces& forces = settings_.forces;
  Vec sum = driving_acceleration(forces, preferred, person.velocity);
  for (std::uint32_t k = neighbour_starts_[i]; k < neighbour_starts_[i + 1]; ++k) {
    const Person& other = people_[neighbours_[k]];
    const Vec offset = person.position - other.position;
    if (other.party == person.party) {
      sum += group_repulsion(forces, offset);
      continue;
    }
    // A person without progress presses forward, and is not repelled by people who make room.
    if (other.yields_to == person.number && person.delay > 0.0) continue;
    const Vec push = pushes_[k];
    if (square(push) < kNegligible * kNegligible) continue;
    sum += view_weight(forces, choice.direction, push) * push;
  }
  for (const Obstacle& obstacle : surroundings_.obstacles()) {
    if (obstacle.is_dynamic && !person.is_aware) continue;
    Vec away;
    if (length(obstacle.center - person.position) - obstacle.radius > settings_.sight) continue;
    const double gap = obstacle.gap(person.position, away);
    const Vec velocity = obstacle.velocity_at(person.position - gap * away);
    // The surface repels like a person whose circumference is on the surface.
    const Vec push = repulsion(forces, (std::max(gap, 0.0) + person.radius) * away,
                               velocity - forces.relative * person.velocity);
    sum += view_weight(forces, choice.direction, push) * push;
  }
  near_.clear();
  add_walls(i, person.radius + wall_sight(person), near_);
  keep_sides(person.position, near_);
  for (const NearPoint& wall : near_) {
    sum += wall_repulsion(forces, person.position - wall.point, person.radius);
  }
  const auto& members = parties_[person.party].members;
  if (members.size() > 1 && square(preferred) > 0.0) {
    Vec others;
    for (const std::uint32_t j : members) {
      if (j != i) others += people_[j].position;
    }
    const auto size = static_cast<int>(members.size());
    const Vec center = (1.0 / (size - 1)) * others;
    sum +=
        group_attraction(forces, size, choice.direction, person.velocity, center - person.position);
  }
  return limited(person.velocity + period * sum, kMostSpeed * person.speed);
}

Vec Crowd::by_orca(std::size_t i, Vec preferred, double period) {
  const Person& person = people_[i];
  constexpr double kMargin = 0.05;  // additional gap [m]
  planes_.clear();
  near_.clear();
  add_walls(i, person.radius + wall_sight(person), near_);
  keep_sides(person.position, near_);
  for (const NearPoint& wall : near_) {
    planes_.push_back(keep_off(unit(person.position - wall.point, {1.0, 0.0}),
                               wall.distance - person.radius, {}, settings_.wall_horizon));
  }
  for (const Obstacle& obstacle : surroundings_.obstacles()) {
    if (obstacle.is_dynamic && !person.is_aware) continue;
    if (length(obstacle.center - person.position) - obstacle.radius > settings_.sight) continue;
    Vec away;
    const double gap = obstacle.gap(person.position, away) - person.radius - kMargin;
    const Vec velocity = obstacle.velocity_at(person.position);
    planes_.push_back(keep_off(away, gap, velocity, settings_.wall_horizon));
  }
  const std::size_t hard = planes_.size();
  const Disc disc{person.position, person.velocity, person.radius + 0.5 * kMargin};
  for (std::uint32_t k = neighbour_starts_[i]; k < neighbour_starts_[i + 1]; ++k) {
    const Person& other = people_[neighbours_[k]];
    if (!see_each_other(i, neighbours_[k])) continue;
    planes_.push_back(avoid(disc, {other.position, other.velocity, other.radius + 0.5 * kMargin},
                            settings_.horizon, 0.5, period));
  }
  return nearest_point(planes_, hard, most_speed(person), preferred);
}

// Returns the velocity nearest to a given one with which person i touches neither walls nor others
// until the next update. Each half-plane keeps a gap along the line between the nearest points,
// which is sufficient because all shapes are convex. People with an index below `decided_` move
// with the velocities in `chosen_`. The other people count as standing: their velocities are chosen
// later, and then respect the velocity of person i. Standing still is therefore always possible.
Vec Crowd::without_contact(std::size_t i, Vec velocity, double period) {
  const Person& person = people_[i];
  planes_.clear();
  near_.clear();
  const double fastest = most_speed(person);
  add_walls(i, person.radius + kSkin + fastest * period, near_);
  for (const NearPoint& wall : near_) {
    const Vec away = unit(person.position - wall.point, {1.0, 0.0});
    planes_.push_back({away, closing_offset(wall.distance - person.radius, period)});
  }
  const std::size_t hard = planes_.size();
  for (const Obstacle& obstacle : surroundings_.obstacles()) {
    if (obstacle.is_dynamic && !person.is_aware) continue;
    Vec away;
    const double reach = person.radius + 2.0 * fastest * period + obstacle.radius;
    if (length(obstacle.center - person.position) > reach) continue;
    const double gap = obstacle.gap(person.position, away);
    const Vec moved = obstacle.velocity_at(person.position - gap * away);
    const double offset = closing_offset(gap - person.radius, period) + dot(moved, away);
    planes_.push_back({away, std::min(offset, fastest)});
  }
  for (std::uint32_t k = neighbour_starts_[i]; k < neighbour_starts_[i + 1]; ++k) {
    const std::size_t j = neighbours_[k];
    const Person& other = people_[j];
    const Vec offset = person.position - other.position;
    const double gap = length(offset) - person.radius - other.radius;
    if (gap > kSkin + (fastest + most_speed(other)) * period) continue;
    const Vec away = unit(offset, {person.number < other.number ? 1.0 : -1.0, 0.0});
    const Vec moved = j < decided_ ? chosen_[j] : Vec{};
    planes_.push_back({away, closing_offset(gap, period) + dot(moved, away)});
  }
  const auto violation_of = [this](Vec v) {
    double most = 0.0;
    for (const HalfPlane& plane : planes_) {
      most = std::max(most, plane.offset - dot(plane.normal, v));
    }
    return most;
  };
  const Vec nearest = nearest_point(planes_, hard, fastest, velocity);
  // With almost parallel half-planes, rounding can produce a velocity that is worse than standing.
  return violation_of(nearest) <= violation_of({}) + kRounding ? nearest : Vec{};
}

void Crowd::update(World& world, std::int64_t step, double dt) {
  const double period = dt * static_cast<double>(settings_.interval);
  world.catch_up();
  read_people(world);
  read_surroundings(world);
  for (const Person& person : people_) {
    const Way* way = way_to_[target_of(person)].get();
    if (way != nullptr) way->field().prefetch(person.position);
  }
  find_walls(period);
  find_neighbours();
  count_guests();
  choices_.resize(people_.size());
  for (std::size_t i = 0; i < people_.size(); ++i) {
    choices_[i] = choose(people_[i], step, dt, period);
  }
  keep_doors_clear(choices_, step, dt);
  keep_right(choices_);
  give_way(choices_, step, dt, period);
  chosen_.resize(people_.size());
  for (std::size_t i = 0; i < people_.size(); ++i) {
    const Person& person = people_[i];
    const Choice& choice = choices_[i];
    Vec preferred = choice.velocity;
    if (square(preferred) > 0.0) {
      preferred += settings_.fluctuation * normal(settings_.key, kFluctuations + person.number,
                                                  2 * static_cast<std::uint64_t>(step));
    }
    chosen_[i] = settings_.model == Settings::Model::kSocialForce
                     ? by_social_force(i, choice, preferred, period)
                     : by_orca(i, preferred, period);
  }
  for (decided_ = 0; decided_ < people_.size(); ++decided_) {
    const std::size_t i = decided_;
    if (!settings_.is_dynamic) chosen_[i] = without_contact(i, chosen_[i], period);
    move_body(world, i, choices_[i], chosen_[i], period);
  }
}

void Crowd::move_body(World& world, std::size_t i, const Choice& choice, Vec velocity,
                      double period) {
  Person& person = people_[i];
  b2Body* body = world.find_body(person.body);
  const double speed = length(velocity);
  double turn = 0.0;
  const Vec facing = speed > kStanding ? velocity : choice.direction;
  if (square(facing) > 0.0) {
    const double error = normalized(std::atan2(facing.y, facing.x) - person.heading);
    turn = error * std::min(1.0 / kTurning, 1.0 / period);
  }
  if (settings_.is_dynamic) {
    person.acceleration = limited((1.0 / period) * (velocity - person.velocity), kMostAcceleration);
    body->SetAngularVelocity(static_cast<float>(turn));
  } else {
    person.velocity = velocity;
    set_velocity(body, {velocity.x, velocity.y, turn});
  }
  person.phase = advance_phase(person.phase, speed * period, speed);
  person.heading += turn * period;
  if (person.legs[0] != 0) move_legs(world, person, person.position + period * velocity, period);
}

void Crowd::move_legs(World& world, const Person& person, Vec next, double period) {
  const Walls& walls = surroundings_.walls();
  const Vec ahead{std::cos(person.heading), std::sin(person.heading)};
  const double along = leg_offset(person.phase, length(person.velocity));
  for (int side = 0; side < 2; ++side) {
    b2Body* leg = world.find_body(person.legs[side]);
    if (leg == nullptr) continue;
    const double sign = side == 0 ? 1.0 : -1.0;
    Vec offset = sign * (along * ahead + 0.5 * settings_.leg_spacing * left_of(ahead));
    // The offset is reduced until the foot does not touch a wall.
    for (int tries = 0;
         tries < 3 && walls.distance(next + offset, settings_.leg_radius) < settings_.leg_radius;
         ++tries) {
      offset = 0.5 * offset;
    }
    const Triple pose = pose_of(*leg);
    const Vec step = next + offset - Vec{pose[0], pose[1]};
    const Vec velocity = limited((1.0 / period) * step, 10.0);
    set_velocity(leg, {velocity.x, velocity.y, normalized(person.heading - pose[2]) / period});
  }
}

}  // namespace flatland::crowd
