// What people avoid besides each other: walls, which do not move, and bodies that do.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_world.h>

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_set>
#include <vector>

#include "crowd/vec.h"
#include "crowd/walls.h"
#include "world/slot_map.h"

namespace flatland::crowd {

// A convex part of a moving body.
struct Obstacle {
  std::vector<Vec> corners;  // counter-clockwise; empty for a circle
  Vec center;                // of the circle, or of the corners
  double radius = 0.0;       // of the circle, or around the center
  Vec origin, velocity;      // of the body
  double omega = 0.0;        // of the body
  bool is_dynamic = false;   // otherwise, the body is kinematic

  // Returns the distance of the surface from a point, negative inside. `away` receives the unit
  // vector from the surface to the point.
  double gap(Vec p, Vec& away) const;
  Vec velocity_at(Vec p) const { return velocity + omega * left_of(p - origin); }
};

// Reads the walls and the obstacles from a physics world.
class Surroundings {
 public:
  // Only fixtures that collide in one of the layers of `bits` count.
  explicit Surroundings(std::uint16_t bits = 0) : bits_(bits) {}

  // Reads all bodies except `own`. Returns whether the walls have changed.
  bool read(const b2World& engine, const std::unordered_set<Id>& own);

  const Walls& walls() const { return *walls_; }
  const std::vector<Obstacle>& obstacles() const { return obstacles_; }

 private:
  // Identifies a static body with its fixtures at its pose.
  struct Key {
    std::array<std::uint64_t, 2> ids;  // of the body and of its newest fixture
    std::array<float, 3> pose;

    bool operator==(const Key& other) const { return ids == other.ids && pose == other.pose; }
  };

  bool counts(const b2Fixture& fixture) const;
  void add_segments(const b2Body& body, std::vector<Segment>& segments) const;
  void add_obstacles(const b2Body& body);

  std::uint16_t bits_;
  std::vector<Key> keys_;
  std::shared_ptr<const Walls> walls_ = std::make_shared<const Walls>(std::vector<Segment>{});
  std::vector<Obstacle> obstacles_;
};

}  // namespace flatland::crowd
