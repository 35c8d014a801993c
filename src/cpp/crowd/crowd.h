// A crowd: people of a world, each with a body and possibly legs, who walk on their own.
//
// A crowd is a value that refers to bodies by id, so that a copy of a world can copy it. Every few
// steps it chooses the velocity of each person; in between, the physics moves kinematic bodies with
// these velocities, and dynamic ones with the accelerations of the model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_set>
#include <vector>

#include "crowd/flow_field.h"
#include "crowd/gates.h"
#include "crowd/half_planes.h"
#include "crowd/people.h"
#include "crowd/surroundings.h"

namespace flatland {

class World;

namespace crowd {

class Crowd {
 public:
  Crowd() : Crowd(Settings{}) {}
  explicit Crowd(const Settings& settings) : settings_(settings), surroundings_(settings.bits) {}

  std::int64_t order = 0;       // of the plugin
  bool is_automatic = false;    // whether each step carries it out
  std::uint64_t last_step = 0;  // number of the step in which it was carried out last

  // Carries out step k, before its physics.
  void advance(World& world, std::int64_t k, double dt);

  std::uint32_t add_waypoint(const Waypoint& waypoint);
  std::uint32_t add_route(const Route& route);
  std::uint32_t add_party(std::uint32_t route, std::uint32_t first_leg, bool is_backward);
  // Returns the number of the person.
  std::uint32_t add_person(Person person);
  void remove_person(Id body);
  void set_key(std::uint64_t key) { settings_.key = key; }

  std::size_t waypoint_count() const { return waypoints_.size(); }
  std::size_t route_count() const { return routes_.size(); }
  std::size_t route_size(std::uint32_t route) const { return routes_[route].waypoints.size(); }
  std::size_t party_count() const { return parties_.size(); }
  const std::vector<Person>& people() const { return people_; }
  Person* find(Id body);
  // The waypoint to which a person walks, or at which the person has arrived.
  std::uint32_t target_of(const Person& person) const;
  // Whether a person stands on purpose: stopped, waiting or in a queue.
  bool is_standing(const Person& person) const;
  // The number of cells of the grid from which there is a way to a waypoint; reads the walls.
  std::size_t reach_of(World& world, std::uint32_t waypoint);
  // The direction of the way from a place to a waypoint, 0 if there is none; reads the walls.
  Vec way_from(World& world, std::uint32_t waypoint, Vec place);
  // Everything besides bodies that affects the future, as numbers.
  std::vector<double> state() const;

 private:
  struct Choice {
    Vec velocity;
    Vec direction;         // of the way, also of somebody who stands
    bool is_held = false;  // at a door, while others come out
  };

  // Who gives way: those who walk to those with a higher priority, those who are idle at a waypoint
  // to everybody, and those who are stopped or in a queue to nobody.
  enum class Stance : std::uint8_t { kWalking, kIdle, kFixed };

  void read_surroundings(const World& world);
  void read_people(World& world);
  const FlowField* field_of(std::uint32_t waypoint);
  Vec way_to(std::uint32_t waypoint, Vec p);
  double draw(std::uint64_t& draws, std::uint64_t stream, Span span);

  // routes.cpp: where a person wants to walk.
  Choice choose(Person& person, std::int64_t step, double dt, double period);
  Choice approach(const Person& person, std::uint32_t waypoint);
  Choice queue_up(Person& person, Party& party, std::uint32_t waypoint, std::int64_t step,
                  double dt);
  void arrive(Party& party, std::uint32_t waypoint, std::int64_t step, double dt);
  void leave(Party& party, std::uint32_t waypoint, std::int64_t step);
  void count_guests();
  bool has_arrived(const Person& person, std::uint32_t waypoint) const;

  // right_of_way.cpp: who passes a door first, and on which side people pass each other.
  struct Approach {
    std::size_t person = 0;
    std::size_t gate = 0;
    int direction = 0;  // index, see Demand
    bool is_inside = false;
  };

  void keep_doors_clear(std::vector<Choice>& choices, std::int64_t step, double dt);
  bool approaches(std::size_t i, const Choice& choice, std::size_t gate, Approach& approach);
  Choice step_aside(const Person& person, const Choice& choice, const Approach& approach) const;
  bool comes_towards(const Person& person, Vec way, std::size_t j, const Choice& choice,
                     double& ahead) const;
  void keep_right(std::vector<Choice>& choices) const;

  // giving_way.cpp: who makes room for whom.
  bool precedes(const Person& a, const Person& b) const;
  Stance stance_of(const Person& person, const Choice& choice) const;
  void give_way(std::vector<Choice>& choices, std::int64_t step, double dt, double period);
  void ask_for_room(std::size_t root, const std::vector<Choice>& choices,
                    const std::vector<Stance>& stances, std::vector<bool>& is_asked,
                    std::int64_t until);

  // motion.cpp: how a person moves.
  void find_neighbours();
  Vec by_social_force(std::size_t i, const Choice& choice, Vec preferred, double period);
  Vec by_orca(std::size_t i, Vec preferred, double period);
  Vec without_contact(std::size_t i, Vec velocity, double period);
  void move_body(World& world, std::size_t i, const Choice& choice, Vec velocity, double period);
  void move_legs(World& world, const Person& person, Vec next, double period);
  void update(World& world, std::int64_t step, double dt);

  Settings settings_;
  std::vector<Waypoint> waypoints_;
  std::vector<Route> routes_;
  std::vector<Party> parties_;
  std::vector<Person> people_;
  std::vector<std::vector<std::uint32_t>> queues_;  // numbers of people by waypoint
  std::uint32_t next_number_ = 0;

  Surroundings surroundings_;
  std::unordered_set<Id> own_;            // bodies and legs
  std::shared_ptr<const FreeGrid> grid_;  // null without walls, or if it is to be created
  bool has_grid_ = false;
  std::vector<std::shared_ptr<const FlowField>> fields_;  // by waypoint, null if not needed yet
  std::shared_ptr<const std::vector<Gate>> gates_ = std::make_shared<const std::vector<Gate>>();
  std::vector<Signal> signals_;  // of the gates

  // Of one update.
  std::vector<std::uint32_t> guests_;  // people who stand at each waypoint
  std::vector<std::uint32_t> neighbours_, neighbour_starts_;
  std::vector<Vec> chosen_;
  std::size_t decided_ = 0;  // people whose velocity is chosen
  std::vector<NearPoint> near_;
  std::vector<HalfPlane> planes_;
};

}  // namespace crowd
}  // namespace flatland
