#include "crowd/crowd.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "crowd/random.h"
#include "crowd/region.h"
#include "world/bodies.h"
#include "world/errors.h"
#include "world/world.h"

namespace flatland::crowd {

std::uint32_t Crowd::add_waypoint(const Waypoint& waypoint) {
  std::uint32_t index = 0;
  const auto is_sent_there = [&](const Person& person) { return person.sent_to == index; };
  const auto is_free = [&] {
    return waypoint.is_temporary && waypoints_[index].is_temporary &&
           std::none_of(people_.begin(), people_.end(), is_sent_there);
  };
  while (index < waypoints_.size() && !is_free()) ++index;
  if (index == waypoints_.size()) {
    waypoints_.emplace_back();
    queues_.emplace_back();
    way_to_.emplace_back();
  }
  waypoints_[index] = waypoint;
  way_to_[index].reset();
  if (ways_ != nullptr) {
    const FreeGrid& grid = ways_->grid();
    const Vec size{grid.cell() * static_cast<double>(grid.columns()),
                   grid.cell() * static_cast<double>(grid.rows())};
    const Vec high = grid.low() + size;
    const Place& place = waypoint.place;
    const bool is_inside = place.low.x > grid.low().x && place.low.y > grid.low().y &&
                           place.high.x < high.x && place.high.y < high.y;
    if (!is_inside) has_grid_ = false;
  }
  return index;
}

Id Crowd::send(World& world, const std::vector<Id>& bodies, const Place& place) {
  const auto position = [&](Id body) {
    const Triple pose = pose_of(world, body);
    return Vec{pose[0], pose[1]};
  };
  const bool is_outside = walls_apart_from(world, place).has_value();
  for (const Id body : bodies) {
    if (is_outside && !leads_out(position(body))) return body;
  }
  const Crowd before = *this;
  Waypoint goal;
  goal.place = place;
  goal.is_temporary = true;
  const std::uint32_t waypoint = add_waypoint(goal);
  try {
    for (const Id body : bodies) {
      if (square(way_from(world, waypoint, position(body))) > 0.0) continue;
      *this = before;
      return body;
    }
  } catch (const PhysicsError&) {  // from `find_region`
    *this = before;
    throw;
  }
  for (const Id body : bodies) {
    Person* person = find(body);
    person->sent_to = waypoint;
    person->is_stopped = false;
  }
  return 0;
}

std::uint32_t Crowd::add_route(const Route& route) {
  routes_.push_back(route);
  return static_cast<std::uint32_t>(routes_.size() - 1);
}

void Crowd::add_party(std::uint32_t route, std::uint32_t first_leg,
                      const std::vector<Person>& people) {
  Party party;
  party.number = next_party_++;
  party.route = route;
  party.leg = first_leg;
  for (Person person : people) {
    person.number = next_number_++;
    person.party = static_cast<std::uint32_t>(parties_.size());
    party.members.push_back(static_cast<std::uint32_t>(people_.size()));
    own_.insert(person.body);
    for (const Id leg : person.legs) {
      if (leg != 0) own_.insert(leg);
    }
    people_.push_back(person);
    // Now rather than in the first update, so that copies of the crowd share the result.
    surroundings_.extend(wall_range(person, 0.0));
  }
  parties_.push_back(std::move(party));
}

void Crowd::remove_person(Id body) {
  const Person* found = find(body);
  if (found == nullptr) return;
  const Person person = *found;
  own_.erase(person.body);
  for (const Id leg : person.legs) own_.erase(leg);
  for (auto& queue : queues_) {
    queue.erase(std::remove(queue.begin(), queue.end(), person.number), queue.end());
  }
  people_.erase(people_.begin() + (found - people_.data()));
  if (parties_[person.party].members.size() == 1) {
    parties_.erase(parties_.begin() + person.party);
    for (Person& other : people_) {
      if (other.party > person.party) --other.party;
    }
  }
  for (Party& party : parties_) party.members.clear();
  for (std::uint32_t i = 0; i < people_.size(); ++i) {
    parties_[people_[i].party].members.push_back(i);
  }
}

Person* Crowd::find(Id body) {
  const auto found = std::find_if(people_.begin(), people_.end(),
                                  [body](const Person& person) { return person.body == body; });
  return found == people_.end() ? nullptr : &*found;
}

const Person* Crowd::numbered(std::uint32_t number) const {
  const auto found =
      std::lower_bound(people_.begin(), people_.end(), number,
                       [](const Person& person, std::uint32_t n) { return person.number < n; });
  return found == people_.end() || found->number != number ? nullptr : &*found;
}

bool Crowd::is_queued(const Person& person) const {
  const auto& queue = queues_[target_of(person)];
  return std::find(queue.begin(), queue.end(), person.number) != queue.end();
}

std::uint32_t Crowd::target_of(const Person& person) const {
  if (person.sent_to != kNone) return person.sent_to;
  const Party& party = parties_[person.party];
  return routes_[party.route].waypoints[party.leg];
}

bool Crowd::is_standing(const Person& person) const {
  const Party& party = parties_[person.party];
  return person.is_stopped || person.stop_until != 0 || party.is_waiting || party.is_done ||
         is_queued(person);
}

std::size_t Crowd::reach_of(World& world, std::uint32_t waypoint) {
  if (walls_apart_from(world, waypoints_[waypoint].place)) return 1;
  const Way* way = way_of(waypoint);
  return way == nullptr ? 1 : way->field().reached();
}

std::optional<Box> Crowd::walls_apart_from(const World& world, const Place& place) {
  read_surroundings(world);
  const Walls& walls = surroundings_.walls();
  if (walls.empty()) return std::nullopt;
  const Box box{walls.low(), walls.high(), false};
  return box.widened(kBorder).is_apart({place.low, place.high, false}) ? std::optional(box)
                                                                       : std::nullopt;
}

bool Crowd::leads_out(Vec p) {
  const Walls& walls = surroundings_.walls();
  const Box box = Box{walls.low(), walls.high(), false}.widened(kBorder);
  if (box.is_apart({p, p, false})) return true;
  if (way_out_ == nullptr) {
    const FreeGrid grid(walls, box.low, box.high, settings_.cell, settings_.clearance);
    way_out_ = std::make_shared<const FlowField>(FlowField::outwards(grid));
  }
  return square(way_out_->direction(p, walls)) > 0.0;
}

Vec Crowd::way_from(World& world, std::uint32_t waypoint, Vec place) {
  if (walls_apart_from(world, waypoints_[waypoint].place) && !leads_out(place)) return {};
  const Way* way = way_of(waypoint);
  return way == nullptr ? unit(waypoints_[waypoint].place.nearest(place) - place, {1.0, 0.0})
                        : way->field().direction(place, surroundings_.walls());
}

std::vector<double> Crowd::state() const {
  std::vector<double> numbers{static_cast<double>(settings_.key >> 32U),
                              static_cast<double>(settings_.key & 0xFFFFFFFFU)};
  const auto add = [&](std::initializer_list<double> more) { numbers.insert(numbers.end(), more); };
  for (const Person& p : people_) {
    add({static_cast<double>(p.number), static_cast<double>(parties_[p.party].number), p.radius,
         p.speed, static_cast<double>(p.is_aware), static_cast<double>(p.is_stopped),
         static_cast<double>(p.sent_to), static_cast<double>(p.stop_until),
         static_cast<double>(p.draws), p.delay, p.lost, static_cast<double>(p.yields_to),
         static_cast<double>(p.yield_until), p.velocity.x, p.velocity.y, p.heading, p.phase,
         p.acceleration.x, p.acceleration.y});
  }
  for (const Party& p : parties_) {
    add({static_cast<double>(p.route), static_cast<double>(p.leg),
         static_cast<double>(p.is_backward), static_cast<double>(p.is_waiting),
         static_cast<double>(p.is_done), static_cast<double>(p.wait_until),
         static_cast<double>(p.draws), static_cast<double>(p.since)});
  }
  for (const auto& queue : queues_) {
    add({static_cast<double>(queue.size())});
    numbers.insert(numbers.end(), queue.begin(), queue.end());
  }
  for (const Signal& signal : signals_) {
    add({static_cast<double>(signal.gate), static_cast<double>(signal.direction),
         static_cast<double>(signal.opposed_since)});
  }
  return numbers;
}

void Crowd::read_surroundings(const World& world) {
  if (surroundings_.read(world.engine(), own_)) has_grid_ = false;
  if (has_grid_) return;
  for (auto& way : way_to_) way.reset();
  ways_.reset();
  way_out_.reset();
  region_.reset();
  signals_.clear();
  const std::vector<Segment>& segments = surroundings_.segments();
  if (!segments.empty()) {
    std::vector<Box> places;
    for (const Waypoint& waypoint : waypoints_) {
      places.push_back({waypoint.place.low, waypoint.place.high, false});
    }
    const Region region = find_region(segments, places, settings_.cell);
    region_ = region.is_partial ? std::optional(region.box) : std::nullopt;
    // Walls beyond this distance have no effect on people in the region.
    constexpr double kSurroundings = 20.0;  // m
    surroundings_.restrict_to(region_ ? std::optional(region_->widened(kSurroundings))
                                      : std::nullopt);
    const Box area = region.box.widened(kBorder);
    ways_ = std::make_shared<Ways>(
        FreeGrid(surroundings_.walls(), area.low, area.high, settings_.cell, settings_.clearance),
        surroundings_.shared_walls());
  }
  has_grid_ = true;
}

void Crowd::read_people(World& world) {
  for (Person& person : people_) {
    const b2Body* body = world.find_body(person.body);
    const Triple pose = pose_of(*body);
    person.position = {pose[0], pose[1]};
    person.heading = pose[2];
    if (settings_.is_dynamic) {
      const b2Vec2 v = body->GetLinearVelocity();
      person.velocity = {static_cast<double>(v.x), static_cast<double>(v.y)};
    }
  }
}

const Way* Crowd::way_of(std::uint32_t waypoint) {
  if (ways_ == nullptr) return nullptr;
  auto& way = way_to_[waypoint];
  if (way == nullptr) {
    // The ways to temporary waypoints, of which there may be any number, end with them.
    const Waypoint& goal = waypoints_[waypoint];
    way = goal.is_temporary ? ways_->to_temporary(goal.place) : ways_->to(goal.place);
  }
  return way.get();
}

Vec Crowd::way_to(std::uint32_t waypoint, Vec p) {
  const Way* way = way_of(waypoint);
  return way == nullptr ? unit(waypoints_[waypoint].place.nearest(p) - p) : way->from(p);
}

double Crowd::draw(std::uint64_t& draws, std::uint64_t stream, Span span) {
  return span.least + (span.most - span.least) * uniform(settings_.key, stream, draws++);
}

void Crowd::advance(World& world, std::int64_t k, double dt) {
  if (k % settings_.interval == 0) update(world, k, dt);
  if (!settings_.is_dynamic) return;
  for (const Person& person : people_) {
    b2Body* body = world.find_body(person.body);
    const Vec change = dt * person.acceleration;
    body->SetLinearVelocity(body->GetLinearVelocity() +
                            b2Vec2(static_cast<float>(change.x), static_cast<float>(change.y)));
  }
}

}  // namespace flatland::crowd
