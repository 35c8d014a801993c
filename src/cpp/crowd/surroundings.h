// What people avoid besides each other: walls, which are static, and obstacles, which move.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_world.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_set>
#include <vector>

#include "crowd/region.h"
#include "crowd/walls.h"
#include "vec.h"
#include "world/slot_map.h"

namespace flatland::crowd {

// A convex part of a moving body.
struct Obstacle {
  std::vector<Vec> corners;  // counter-clockwise; empty for a circle
  Vec center;                // center of the circle, or centroid of the corners
  double radius = 0.0;       // radius of the circle, or of a disc that contains the corners
  Vec origin, velocity;      // position and velocity of the origin of the body
  double omega = 0.0;        // angular velocity of the body
  bool is_dynamic = false;   // whether the body is dynamic, otherwise kinematic

  // Returns the distance of a point from the surface, negative inside. Sets `away` to the unit
  // vector from the surface to the point.
  double gap(Vec p, Vec& away) const;
  Vec velocity_at(Vec p) const { return velocity + omega * left_of(p - origin); }
};

// The walls and the obstacles of a physics world.
class Surroundings {
 public:
  // Considers only fixtures that collide and have one of the category bits.
  explicit Surroundings(std::uint16_t bits = 0) : bits_(bits) {}

  // Reads all bodies except `own`. Returns whether the walls have changed.
  bool read(const b2World& engine, const IdSet& own);
  // Ignores the walls outside of a box, or no walls without a box.
  void restrict_to(const std::optional<Box>& box);
  // Allows queries of the walls up to a range.
  void extend(double reach);

  const Walls& walls() const { return *walls_; }
  // All walls, also those that are ignored.
  const std::vector<Segment>& segments() const { return all_ ? *all_ : walls_->segments(); }
  std::shared_ptr<const Walls> shared_walls() const { return walls_; }
  const std::vector<Obstacle>& obstacles() const { return obstacles_; }

 private:
  // Identifies a static body with its fixtures at its pose.
  struct Key {
    std::array<std::uint64_t, 2> ids;  // ids of the body and of the newest fixture
    std::array<float, 3> pose;

    bool operator==(const Key& other) const { return ids == other.ids && pose == other.pose; }
  };

  static Key key_of(const b2Body& body);
  bool counts(const b2Fixture& fixture) const;
  void add_segments(const b2Body& body, std::vector<Segment>& segments) const;
  void add_obstacles(const b2Body& body);

  std::uint16_t bits_;
  std::vector<Key> keys_;                            // of the bodies of the walls
  std::vector<const b2Body*> fixed_;                 // valid within `read`
  std::shared_ptr<const std::vector<Segment>> all_;  // null if no walls are ignored
  std::shared_ptr<const Walls> walls_ = std::make_shared<const Walls>(std::vector<Segment>{}, 0.0);
  std::vector<Obstacle> obstacles_;
};

}  // namespace flatland::crowd
