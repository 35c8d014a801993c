#include "world/path_motion.h"

#include <cmath>

#include "angles.h"
#include "split_mix.h"
#include "world/bodies.h"
#include "world/joined_bodies.h"

namespace flatland {
namespace {

double shortest_turn(double from, double to) { return std::remainder(to - from, kTwoPi); }

double inverse(double limit) { return limit == 0.0 ? 0.0 : 1.0 / limit; }

void choose_next(PathMotion& motion) {
  const std::size_t count = motion.path->waypoints.size();
  switch (motion.path->mode) {
    case Path::Mode::kLoop:
      motion.next = (motion.waypoint + 1) % count;
      break;
    case Path::Mode::kRandom: {
      const std::uint64_t word = split_mix(motion.key + motion.legs * kSplitMixStep);
      motion.next = (motion.waypoint + 1 + word % (count - 1)) % count;
      break;
    }
    default:
      if (motion.waypoint + 1 == count) motion.is_forward = false;
      if (motion.waypoint == 0) motion.is_forward = true;
      motion.next = motion.is_forward ? motion.waypoint + 1 : motion.waypoint - 1;
  }
}

// Computes the motion from the current pose to the next waypoint.
void begin_leg(PathMotion& motion, double wait) {
  const Path& path = *motion.path;
  motion.is_moving = true;
  motion.time = 0.0;
  motion.wait = wait;
  motion.from = motion.pose;
  motion.to = path.waypoints[motion.next];
  const double dx = motion.to[0] - motion.from[0];
  const double dy = motion.to[1] - motion.from[1];
  const double distance = std::hypot(dx, dy);
  if (path.faces_forward) {
    motion.to[2] = distance > 0.0 ? std::atan2(dy, dx) : motion.from[2];
  }
  const double turn = shortest_turn(motion.from[2], motion.to[2]);
  // The angle of the end is exact. The angle of the start may differ by a full turn.
  motion.from[2] = motion.to[2] - turn;
  if (path.faces_forward) {
    motion.turn = Trapezoid::over(std::abs(turn), path.angular);
    motion.drive = Trapezoid::over(distance, path.linear);
    return;
  }
  // Translation and rotation start and end together. The slower motion determines the time.
  SpeedLimits limits;
  const auto reduce = [](double& limit, double other) {
    if (other != 0.0 && (limit == 0.0 || other < limit)) limit = other;
  };
  for (const auto& [each, length] :
       {std::pair(path.linear, distance), std::pair(path.angular, std::abs(turn))}) {
    if (length == 0.0) continue;
    reduce(limits.velocity, each.velocity / length);
    reduce(limits.acceleration, each.acceleration / length);
    reduce(limits.deceleration, each.deceleration / length);
  }
  motion.turn = Trapezoid();
  motion.drive = limits.velocity > 0.0 ? Trapezoid::over(1.0, limits) : Trapezoid();
}

double duration_of(const PathMotion& motion) {
  return motion.wait + motion.turn.duration() + motion.drive.duration();
}

Triple pose_at(const PathMotion& motion, double time) {
  const double t = time - motion.wait;
  if (t <= 0.0) return motion.from;
  Triple pose = motion.from;
  const double turn = motion.to[2] - motion.from[2];
  const double t_drive = t - motion.turn.duration();
  if (motion.path->faces_forward) {
    if (t_drive <= 0.0) {
      pose[2] += std::copysign(motion.turn.at(t), turn);
      return pose;
    }
    pose[2] = motion.to[2];
  }
  const double length = motion.drive.distance;
  const double share = length > 0.0 ? motion.drive.at(t_drive) / length : 0.0;
  for (std::size_t i = 0; i < 2; ++i) pose[i] += share * (motion.to[i] - motion.from[i]);
  if (!motion.path->faces_forward) pose[2] += share * turn;
  return pose;
}

void arrive(PathMotion& motion) {
  motion.pose = motion.to;
  motion.waypoint = motion.next;
  motion.is_moving = false;
  const std::size_t last = motion.path->waypoints.size() - 1;
  if (motion.path->mode == Path::Mode::kOnce && (motion.waypoint == 0 || motion.waypoint == last)) {
    motion.is_finished = true;
    motion.used_starts = motion.starts;
  }
}

bool may_start(const PathMotion& motion) {
  return motion.is_started && (!motion.is_finished || motion.starts > motion.used_starts);
}

void advance_time(PathMotion& motion, double dt) {
  double wait = 0.0;  // A body at rest starts without waiting.
  // If all waypoints are at one place, the time of a round is zero.
  for (std::size_t i = 0; i <= motion.path->waypoints.size(); ++i) {
    if (!motion.is_moving) {
      if (!may_start(motion)) return;
      motion.is_finished = false;
      choose_next(motion);
      begin_leg(motion, wait);
      ++motion.legs;
    }
    const double remaining = duration_of(motion) - motion.time;
    // A sum of steps that reaches the waypoint except for rounding counts as having arrived.
    constexpr double kRounding = 1e-9;
    if (dt < remaining - kRounding) {
      motion.time += dt;
      motion.pose = pose_at(motion, motion.time);
      return;
    }
    dt -= remaining;
    arrive(motion);
    wait = motion.path->wait;
  }
}

}  // namespace

Trapezoid Trapezoid::over(double distance, const SpeedLimits& limits) {
  Trapezoid motion;
  motion.distance = distance;
  if (!(distance > 0.0)) return motion;
  const double up = inverse(limits.acceleration);
  const double down = inverse(limits.deceleration);
  motion.peak = limits.velocity;
  const double ramps = 0.5 * motion.peak * motion.peak * (up + down);
  if (ramps > distance) {
    motion.peak = std::sqrt(2.0 * distance / (up + down));
  } else {
    motion.cruise = (distance - ramps) / motion.peak;
  }
  motion.rise = motion.peak * up;
  motion.fall = motion.peak * down;
  return motion;
}

double Trapezoid::at(double t) const {
  if (t <= 0.0) return 0.0;
  if (t >= duration()) return distance;
  if (t < rise) return 0.5 * peak * t * t / rise;
  if (t <= rise + cruise) return peak * (t - 0.5 * rise);
  const double left = duration() - t;
  return distance - 0.5 * peak * left * left / fall;
}

void advance_path(b2Body* body, PathMotion& motion, double dt) {
  const Triple before = motion.pose;
  advance_time(motion, dt);
  motion.velocity = {(motion.pose[0] - before[0]) / dt, (motion.pose[1] - before[1]) / dt,
                     shortest_turn(before[2], motion.pose[2]) / dt};
  // Other bodies are pushed with this velocity. The pose after the step is exact in any case.
  set_velocity(body, motion.velocity);
}

void hold_path(World& world, b2Body* body, const PathMotion& motion) {
  const auto is_same = [](double a, double b) {
    return static_cast<float>(a) == static_cast<float>(b);
  };
  const Triple pose = pose_of(*body);
  if (!is_same(pose[0], motion.pose[0]) || !is_same(pose[1], motion.pose[1]) ||
      !is_same(pose[2], motion.pose[2])) {
    set_pose(world, body, motion.pose);
  }
  if (motion.is_dynamic) set_velocity(body, motion.velocity);
}

void place_on_path(World& world, b2Body* body, PathMotion& motion, double share) {
  const Path& path = *motion.path;
  if (!motion.is_started || path.mode == Path::Mode::kOnce) return;
  PathMotion first = motion;
  first.pose = path.waypoints[0];
  first.waypoint = 0;
  first.is_forward = true;
  first.is_moving = first.is_finished = false;
  first.legs = 0;
  const auto begin_next = [&](PathMotion& each) {
    choose_next(each);
    begin_leg(each, path.wait);
    ++each.legs;
    return duration_of(each);
  };
  const std::size_t count = path.waypoints.size();
  const std::size_t legs = path.mode == Path::Mode::kThereAndBack ? 2 * (count - 1) : count;
  double round = 0.0;
  PathMotion measured = first;
  for (std::size_t i = 0; i < legs; ++i) {
    round += begin_next(measured);
    arrive(measured);
  }
  double left = share * round;
  for (std::size_t i = 0; i < legs; ++i) {
    const double duration = begin_next(first);
    if (left < duration) {
      first.time = left;
      first.pose = pose_at(first, left);
      break;
    }
    left -= duration;
    arrive(first);
  }
  first.velocity = {};
  motion = first;
  place_with_joined(world, body, motion.pose);
}

void restart_path(PathMotion& motion, const Triple& pose) {
  motion.pose = pose;
  motion.velocity = {};
  if (motion.is_moving) begin_leg(motion, 0.0);
}

}  // namespace flatland
