// The motion of a body along waypoints, with limits of speed and acceleration.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "world/speed_limits.h"
#include "world/triple.h"

class b2Body;

namespace flatland {

class World;

// The fastest motion from rest to rest over a distance: the speed rises to a peak, remains there,
// and falls to zero.
struct Trapezoid {
  double distance = 0.0;
  double peak = 0.0;    // greatest speed
  double rise = 0.0;    // duration of the acceleration [s]
  double cruise = 0.0;  // duration of the motion at the peak speed [s]
  double fall = 0.0;    // duration of the deceleration [s]

  // Returns the fastest motion. The limit of the speed must be positive; an acceleration or
  // deceleration of 0 stands for no limit.
  static Trapezoid over(double distance, const SpeedLimits& limits);
  double duration() const { return rise + cruise + fall; }
  // Returns the distance travelled after t seconds.
  double at(double t) const;
};

// The waypoints and the limits of a motion, which copies of a world share. The first waypoint is
// the initial pose of the body.
struct Path {
  enum class Mode : std::uint8_t { kLoop, kOnce, kThereAndBack, kRandom };

  std::vector<Triple> waypoints;  // world frame [m, rad]
  Mode mode = Mode::kLoop;
  bool faces_forward = false;  // whether the body turns towards the next waypoint, then drives
  SpeedLimits linear, angular;
  double wait = 0.0;  // time at each waypoint [s]
};

struct PathMotion {
  std::shared_ptr<const Path> path;
  std::uint64_t key = 0;     // key of the random numbers of mode kRandom
  bool is_dynamic = false;   // whether the body is dynamic
  bool is_started = true;    // otherwise, the body stops at the next waypoint
  std::uint64_t starts = 0;  // number of commands to start

  std::size_t waypoint = 0;  // index of the last waypoint that was reached
  std::size_t next = 0;      // index of the waypoint of the current or the next motion
  bool is_forward = true;    // the direction along the waypoints
  bool is_moving = false;    // whether a motion has begun, including the time of waiting
  bool is_finished = false;  // whether the body reached the end of the path in mode kOnce
  std::uint64_t legs = 0;    // number of motions between waypoints that have begun
  std::uint64_t used_starts = 0;

  double time = 0.0;  // since the beginning of this leg [s]
  double wait = 0.0;  // time of waiting at the beginning of this leg [s]
  Triple from{}, to{};
  Trapezoid turn;   // turn before the drive
  Trapezoid drive;  // as a share of the leg if the body does not face forward
  Triple pose{};
  Triple velocity{};
};

// Advances the motion by dt seconds and sets the velocity of the body. Throws as `advance`.
void advance_path(b2Body* body, PathMotion& motion, double dt);
// Moves the body to the pose of the motion.
void hold_path(World& world, b2Body* body, const PathMotion& motion);
// Moves the body to where it is in a round of the waypoints. Has no effect in mode kOnce, and on a
// body that is not started.
//
// `share` is the time since the first waypoint as a share of the duration of the round, from 0
// to 1.
void place_on_path(World& world, b2Body* body, PathMotion& motion, double share);
// Continues from another pose of the body.
void restart_path(PathMotion& motion, const Triple& pose);

}  // namespace flatland
