// People, where they walk, and the parameters of a crowd.
#pragma once

#include <cstdint>
#include <vector>

#include "crowd/flow_field.h"
#include "crowd/social_force.h"
#include "crowd/vec.h"
#include "world/slot_map.h"

namespace flatland::crowd {

inline constexpr std::uint32_t kNone = UINT32_MAX;

// A span of time [s] from which a duration is drawn.
struct Span {
  double least = 0.0;
  double most = 0.0;
};

// A place on a route.
struct Waypoint {
  Place place;
  Span wait;
  bool is_queue = false;  // where people are served one after the other
  double spacing = 0.7;   // of people in the queue [m]
};

struct Route {
  enum class Order : std::uint8_t { kLoop, kBackAndForth, kRandom, kOnce };

  std::vector<std::uint32_t> waypoints;  // not empty
  Order order = Order::kLoop;
  double stop_interval = 0.0;  // mean time between two stops on the way [s], 0 for none
  Span stop;
};

// People who walk together, or a single person.
struct Party {
  std::uint32_t route = 0;
  std::uint32_t leg = 0;  // the waypoint of the route to which they walk
  bool is_backward = false;
  bool is_waiting = false;
  bool is_done = false;         // at the last waypoint of a route of order kOnce
  std::int64_t wait_until = 0;  // step
  std::uint64_t draws = 0;      // of random numbers
  std::int64_t since = 0;       // step in which they left their last waypoint
};

struct Person {
  std::uint32_t number = 0;  // never reused
  Id body = 0;
  Id legs[2] = {0, 0};  // 0 without legs
  std::uint32_t party = 0;
  double radius = 0.2;   // [m]
  double speed = 1.34;   // that the person prefers [m/s]
  bool is_aware = true;  // of robots
  bool is_stopped = false;
  std::uint32_t sent_to = kNone;    // waypoint instead of that of the route
  std::int64_t stop_until = 0;      // step
  std::uint64_t draws = 0;          // of random numbers
  double delay = 0.0;               // time without progress, as far as it is not made up [s]
  double lost = 0.0;                // time without progress since the last waypoint [s]
  std::uint32_t yields_to = kNone;  // number of the person for whom this one makes room
  std::int64_t yield_until = 0;     // step
  Vec position, velocity;           // at the last update
  double heading = 0.0;
  double phase = 0.0;  // of the gait
  Vec acceleration;    // of a dynamic body until the next update
};

struct Settings {
  enum class Model : std::uint8_t { kSocialForce, kOrca };

  Model model = Model::kSocialForce;
  SocialForces forces;
  double horizon = 2.0;        // of ORCA, for other people [s]
  double wall_horizon = 0.5;   // of ORCA, for walls and obstacles [s]
  double fluctuation = 0.1;    // standard deviation of the preferred velocity [m/s]
  double sight = 3.0;          // distance at which others are avoided [m]
  double cell = 0.1;           // of the grid for ways [m]
  double clearance = 0.22;     // distance from walls of the middle of a way, at least [m]
  std::int64_t interval = 10;  // steps between two updates
  std::uint16_t bits = 0;      // of the layers of walls and obstacles
  bool is_dynamic = false;     // whether the bodies are
  double leg_radius = 0.07;    // [m]
  double leg_spacing = 0.2;    // of the centers of both legs across the heading [m]
  std::uint64_t key = 0;       // of all random numbers
};

}  // namespace flatland::crowd
