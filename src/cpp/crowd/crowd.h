// A crowd: people of a world, each with a body and possibly legs, who walk on their own.
//
// A crowd is a value that refers to bodies by id, so that a copy of a world can contain a copy of
// the crowd. An update, every few steps, chooses the velocity of each person. Between two updates,
// kinematic bodies move with these velocities, and dynamic bodies with constant accelerations.
//
// The source files follow the order of an update:
//   crowd.cpp         reads poses, walls and obstacles; contains the methods for callers
//   routes.cpp        where each person wants to walk: waypoints, waiting, queues, stops
//   right_of_way.cpp  who passes a door first, and on which side people pass each other
//   giving_way.cpp    who makes room for whom
//   motion.cpp        the velocity by a model, free of contacts, and the motion of the legs
// redraw.cpp contains the first places of people. Parts without a state: region (which part of the
// world the crowd covers), flow_field and ways (ways on a grid), walls and surroundings (what is
// avoided), gates (doors), segment_grid (walls and doors near a place), social_force and orca with
// half_planes (the models), gait (legs), random.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "crowd/gates.h"
#include "crowd/half_planes.h"
#include "crowd/people.h"
#include "crowd/surroundings.h"
#include "crowd/ways.h"
#include "world/job_place.h"

namespace flatland {

class World;

namespace crowd {

class Crowd {
 public:
  Crowd() : Crowd(Settings{}) {}
  explicit Crowd(const Settings& settings) : settings_(settings), surroundings_(settings.bits) {
    surroundings_.extend(std::max(FreeGrid::range(settings.clearance), settings.leg_radius));
  }

  JobPlace place;

  // Moves the people in step k, before the physics step.
  void advance(World& world, std::int64_t k, double dt);

  std::uint32_t add_waypoint(const Waypoint& waypoint);
  // Makes people walk to a place and stop there, instead of following their routes. Returns the
  // body of a person from whom there is no way to the place, and changes nothing in this case;
  // returns 0 on success.
  Id send(World& world, const std::vector<Id>& bodies, const Place& place);
  std::uint32_t add_route(const Route& route);
  // Adds people who walk together; the list must not be empty.
  void add_party(std::uint32_t route, std::uint32_t first_leg, const std::vector<Person>& people);
  // Draws new places, headings and first waypoints for all people whose places are drawn, with the
  // current key; see redraw.cpp. Returns the body of a person for whom there is no free place, and
  // changes nothing in this case; returns 0 on success.
  Id redraw(World& world);
  // Does nothing if the body is not that of a person. A party ends with its last member.
  void remove_person(Id body);
  void set_key(std::uint64_t key) { settings_.key = key; }

  std::size_t waypoint_count() const { return waypoints_.size(); }
  std::size_t route_count() const { return routes_.size(); }
  std::size_t route_size(std::uint32_t route) const { return routes_[route].waypoints.size(); }
  const std::vector<Person>& people() const { return people_; }
  // Null if the body is not that of a person.
  Person* find(Id body);
  // Returns the waypoint to which a person walks, or at which the person has arrived.
  std::uint32_t target_of(const Person& person) const;
  // Returns whether a person stands on purpose: stopped, waiting or in a queue.
  bool is_standing(const Person& person) const;
  // Returns the number of cells of the grid from which there is a way to a waypoint; 1 for a
  // waypoint outside of the walls, to which no way is computed before it is needed.
  std::size_t reach_of(World& world, std::uint32_t waypoint);
  // Returns the part of the world for which ways are computed, nothing for the whole world.
  std::optional<Box> region(const World& world) {
    read_surroundings(world);
    return region_;
  }
  // Returns the bounds of the walls, nothing without walls or if the place is in this area or next
  // to it.
  std::optional<Box> walls_apart_from(const World& world, const Place& place);
  // Returns the direction of the way from a place to a waypoint, a zero vector if there is none.
  Vec way_from(World& world, std::uint32_t waypoint, Vec place);
  // Returns everything besides the bodies that affects the future, as numbers.
  std::vector<double> state() const;

 private:
  struct Choice {
    Vec velocity;
    Vec direction;         // direction of the way, even if the velocity is zero
    bool is_held = false;  // whether the person waits at a door while others come out
  };

  // To whom a person gives way: kWalking to people with a higher priority, kIdle (at a waypoint) to
  // everybody, kFixed (stopped or in a queue) to nobody.
  enum class Stance : std::uint8_t { kWalking, kIdle, kFixed };

  void read_surroundings(const World& world);
  // Returns whether there is a way from a point to the surroundings of all walls.
  bool leads_out(Vec p);
  void read_people(World& world);
  // Null if the person was removed.
  const Person* numbered(std::uint32_t number) const;
  bool is_queued(const Person& person) const;
  // Null in a world without walls.
  const Way* way_of(std::uint32_t waypoint);
  Vec way_to(std::uint32_t waypoint, Vec p);
  double draw(std::uint64_t& draws, std::uint64_t stream, Span span);

  // redraw.cpp: the first places of people.
  struct Spot {
    Vec position;
    double radius = 0.0;
  };

  bool is_free(const Spot& spot, const std::vector<Spot>& taken) const;
  bool draw_spot(std::size_t i, const std::vector<Spot>& taken, Spot& spot);
  void arrange(const std::vector<std::size_t>& people, std::vector<Spot>& spots) const;
  void begin_again(World& world, std::size_t i, Vec position);

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
    std::uint32_t gate = 0;
    int direction = 0;  // index of a direction, see Demand
    bool is_inside = false;
    double distance = 0.0;  // distance from the center of the gate [m]
  };

  void keep_doors_clear(std::vector<Choice>& choices, std::int64_t step, double dt);
  void find_approaches(std::size_t i, const Choice& choice);
  Signal signal_of(std::uint32_t gate) const;
  void update_signals(std::int64_t step, double dt);
  Choice step_aside(const Person& person, const Choice& choice, const Approach& approach) const;
  bool comes_towards(std::size_t i, Vec way, std::size_t j, const Choice& choice,
                     double& ahead) const;
  void keep_right(std::vector<Choice>& choices) const;

  // giving_way.cpp: who makes room for whom.
  bool precedes(const Person& a, const Person& b) const;
  Stance stance_of(const Person& person, const Choice& choice) const;
  void give_way(std::vector<Choice>& choices, std::int64_t step, double dt, double period);
  void ask_for_room(std::size_t root, const std::vector<Choice>& choices,
                    std::vector<bool>& is_asked, std::int64_t until);

  // motion.cpp: how a person moves.
  void find_neighbours();
  // Returns whether no wall is between two people.
  bool see_each_other(std::size_t i, std::size_t j) const;
  // Computes the repulsions of the neighbours a and b by each other; their places in the list of
  // the other one's neighbours are given.
  void find_pushes(std::uint32_t a, std::uint32_t place_of_b, std::uint32_t b,
                   std::uint32_t place_of_a);
  // Returns the gap below which walls have an effect on the velocity that a person wants.
  double wall_sight(const Person& person) const;
  // Returns the distance within which walls have an effect on the motion of a person.
  double wall_range(const Person& person, double period) const;
  void find_walls(double period);
  // Appends the points of walls within a range of person i, at most that of `find_walls`.
  void add_walls(std::size_t i, double range, std::vector<NearPoint>& found) const;
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
  std::vector<std::vector<std::uint32_t>> queues_;  // numbers of people, by waypoint
  std::uint32_t next_number_ = 0;                   // number of the next person
  std::uint32_t next_party_ = 0;                    // number of the next party

  Surroundings surroundings_;
  IdSet own_;                                       // bodies and legs of all people
  std::optional<Box> region_;                       // nothing for the whole world
  std::shared_ptr<Ways> ways_;                      // null in a world without walls
  bool has_grid_ = false;                           // whether `ways_` and `way_to_` match the walls
  std::shared_ptr<const FlowField> way_out_;        // null if not needed yet
  std::vector<std::shared_ptr<const Way>> way_to_;  // by waypoint, null if not needed yet
  std::vector<Signal> signals_;                     // of the gates with people, by gate
  std::vector<std::uint32_t> sorted_;               // indices of people by x at the last update

  // The members below are valid within one update.
  std::vector<std::uint32_t> guests_;  // number of people who stand at each waypoint
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;  // people who see each other
  std::vector<std::uint32_t> neighbours_, neighbour_starts_;
  std::vector<std::uint32_t> next_;   // the next place of each person in `neighbours_`
  std::vector<Vec> pushes_;           // repulsion by each of `neighbours_`, zero behind walls
  std::vector<std::uint32_t> gates_;  // that a person may approach
  std::vector<Approach> approaching_;
  std::vector<Choice> choices_;
  std::vector<Stance> stances_;
  std::vector<Signal> next_signals_;
  std::vector<Vec> chosen_;            // wanted velocities, and then those of the motion
  std::size_t decided_ = 0;            // number of people whose velocity of the motion is chosen
  std::vector<NearPoint> near_walls_;  // within reach of each person
  std::vector<std::uint32_t> near_wall_starts_;
  std::vector<double> clearances_;  // radius of a disc without walls around each person
  std::vector<NearPoint> near_;
  std::vector<HalfPlane> planes_;
};

}  // namespace crowd
}  // namespace flatland
