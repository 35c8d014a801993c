// The data of a crowd: people, parties, routes, waypoints and parameters.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "crowd/flow_field.h"
#include "crowd/social_force.h"
#include "vec.h"
#include "world/slot_map.h"

namespace flatland::crowd {

inline constexpr std::uint32_t kNone = UINT32_MAX;

// A span of time [s] from which a duration is drawn.
struct Span {
  double least = 0.0;
  double most = 0.0;
};

// A place that people visit.
struct Waypoint {
  Place place;
  Span wait;
  bool is_queue = false;  // whether people queue there, and wait one after the other
  double spacing = 0.7;   // distance of people in the queue [m]
  // Whether the waypoint is on no route. Once nobody is sent to a temporary waypoint, the next
  // temporary waypoint replaces it.
  bool is_temporary = false;
};

struct Route {
  enum class Order : std::uint8_t { kLoop, kBackAndForth, kRandom, kOnce };

  std::vector<std::uint32_t> waypoints;  // not empty
  Order order = Order::kLoop;
  // The area of the first places of people.
  Vec low{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  Vec high{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  double stop_interval = 0.0;  // mean time between two stops on the way [s], 0 for none
  Span stop;                   // duration of a stop
};

// People who walk together, or a single person.
struct Party {
  std::uint32_t number = 0;            // never reused
  std::vector<std::uint32_t> members;  // indices in the list of people, ascending
  std::uint32_t route = 0;
  std::uint32_t leg = 0;  // index in the route of the waypoint to which the party walks
  bool is_backward = false;
  bool is_waiting = false;
  bool is_done = false;         // whether the party reached the end of a route of order kOnce
  std::int64_t wait_until = 0;  // number of a step
  std::uint64_t draws = 0;      // count of random numbers drawn
  std::int64_t since = 0;       // step in which the party left the last waypoint
};

struct Person {
  std::uint32_t number = 0;  // never reused
  Id body = 0;
  Id legs[2] = {0, 0};      // 0 without legs
  std::uint32_t party = 0;  // index in the list of parties
  double radius = 0.2;      // [m]
  double speed = 1.34;      // preferred speed [m/s]
  bool is_aware = true;     // whether the person avoids robots, that is, dynamic bodies
  bool is_stopped = false;
  bool is_redrawn = false;          // whether `redraw` draws another place
  std::uint32_t sent_to = kNone;    // waypoint that replaces the route
  std::int64_t stop_until = 0;      // number of a step, 0 if the person does not stop on the way
  std::uint64_t draws = 0;          // count of random numbers drawn
  double delay = 0.0;               // recent time without progress; progress reduces the time [s]
  double lost = 0.0;                // total time without progress since the last waypoint [s]
  std::uint32_t yields_to = kNone;  // number of the person who gets room
  std::int64_t yield_until = 0;     // number of a step
  Vec position, velocity;           // at the last update
  double heading = 0.0;             // at the last update [rad]
  double phase = 0.0;               // phase of the gait, from 0 to 1
  Vec acceleration;                 // acceleration of a dynamic body until the next update
};

struct Settings {
  enum class Model : std::uint8_t { kSocialForce, kOrca };

  Model model = Model::kSocialForce;
  SocialForces forces;
  double horizon = 2.0;        // time horizon of ORCA for other people [s]
  double wall_horizon = 0.5;   // time horizon of ORCA for walls and obstacles [s]
  double fluctuation = 0.1;    // standard deviation of the preferred velocity [m/s]
  double sight = 3.0;          // distance at which others are avoided [m]
  double cell = 0.1;           // size of the cells of the planning grid [m]
  double clearance = 0.22;     // least distance between a planned way and a wall [m]
  std::int64_t interval = 10;  // steps between two updates
  std::uint16_t bits = 0;      // category bits of walls and obstacles
  bool is_dynamic = false;     // whether the bodies of people are dynamic, otherwise kinematic
  double leg_radius = 0.07;    // [m]
  double leg_spacing = 0.2;    // distance of the centers of both legs across the heading [m]
  std::uint64_t key = 0;       // key of all random numbers
};

}  // namespace flatland::crowd
