// Walls that several worlds share.
//
// In Box2D, each world has its own fixture for each wall. In a world for learning, thousands of
// walls never change, and the few bodies that move touch only some of them. Such worlds share one
// copy of the walls, and each has fixtures of its own only near its dynamic bodies.
//
// A static body with shared walls has the list of the shared fixtures, whose body has the same id
// and pose and belongs to the Box2D world of `SharedWalls`. Box2D does not use the lists of static
// bodies in a step. The fixtures of a world near its dynamic bodies are in no list. They have the
// ids of the shared ones, a place in the broad phase, and contacts.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_collision.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_world.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "world/slot_map.h"

class b2BlockAllocator;

namespace flatland {

// Returns a copy of a fixture for a body whose world owns the memory. It is in no list, and its
// proxy is that of the original.
b2Fixture* duplicate_fixture(const b2Fixture& fixture, b2Body& body, b2BlockAllocator& allocator);

inline bool has_shared_walls(const b2Body& body) {
  return body.GetFixtureList() != nullptr && body.GetFixtureList()->GetBody() != &body;
}

// Deletes a Box2D world, but not the walls that it shares.
struct EngineDeleter {
  void operator()(b2World* engine) const;
};
using Engine = std::unique_ptr<b2World, EngineDeleter>;
Engine make_engine();

// The Box2D worlds with the fixtures of a world.
struct Engines {
  const b2World& own;
  const b2World* walls;  // null if no walls are shared

  // Calls query(engine) for both. Walls near dynamic bodies are in both.
  template <typename Query>
  void for_each(Query&& query) const {
    query(own);
    if (walls != nullptr) query(*walls);
  }
};

// The walls. They never change, so that several threads may use them.
class SharedWalls {
 public:
  // Copies the static bodies of a world that have only edges and no joints.
  explicit SharedWalls(const b2World& world);
  ~SharedWalls() = default;
  SharedWalls(const SharedWalls&) = delete;
  SharedWalls& operator=(const SharedWalls&) = delete;

  const b2World& engine() const { return engine_; }
  // Returns the body with an id; null if it has no shared walls.
  const b2Body* find_body(Id id) const;
  // All fixtures, the oldest of each body first.
  const std::vector<b2Fixture*>& fixtures() const { return fixtures_; }
  // Returns the index of the fixture with the same id, if there is one.
  std::optional<std::size_t> index_of(const b2Fixture& fixture) const;

  // The walls are in the cells of a grid that their boxes in the broad phase overlap.
  std::size_t cell_count() const { return columns_ * rows_; }
  template <typename Visit>
  void for_each_cell(const b2AABB& box, Visit&& visit) const {
    const Range columns =
        cells(box.lowerBound.x - origin_.x, box.upperBound.x - origin_.x, columns_);
    const Range rows = cells(box.lowerBound.y - origin_.y, box.upperBound.y - origin_.y, rows_);
    for (std::size_t row = rows.first; row < rows.end; ++row) {
      for (std::size_t column = columns.first; column < columns.end; ++column) {
        visit(row * columns_ + column);
      }
    }
  }
  template <typename Visit>
  void for_each_in(std::size_t cell, Visit&& visit) const {
    for (std::size_t i = starts_[cell]; i < starts_[cell + 1]; ++i) visit(members_[i]);
  }

 private:
  struct Range {
    std::size_t first;
    std::size_t end;
  };

  void copy_body(const b2Body& body);
  void make_grid();
  // Returns the cells between two distances from the origin along an axis [m].
  Range cells(float low, float high, std::size_t count) const;

  b2World engine_{b2Vec2(0.0F, 0.0F)};
  std::vector<b2Fixture*> fixtures_;
  std::unordered_map<Id, std::size_t> indices_;  // by the id of the fixture
  b2Vec2 origin_{0.0F, 0.0F};
  float cell_size_ = 0.0F;  // [m]
  std::size_t columns_ = 0;
  std::size_t rows_ = 0;
  std::vector<std::size_t> starts_;  // in `members_`, of each cell, and the end
  std::vector<std::size_t> members_;
};

// The shared walls of one world, and its fixtures near dynamic bodies. All functions with a Box2D
// world require that of the same world.
class NearWalls {
 public:
  NearWalls() = default;
  // Creates the walls of a copy of a world, whose bodies have the shared walls already. The
  // fixtures have the places in the broad phase of the source.
  NearWalls(const NearWalls& source, b2World& copy);

  bool are_shared() const { return shared_ != nullptr; }
  // Whether the pose of a body with shared walls is not finite.
  bool has_invalid_body() const;
  const SharedWalls* shared() const { return shared_.get(); }

  // Replaces the walls of a world by shared ones. Contacts with them end.
  void share(b2World& world);
  // Replaces all shared walls by fixtures of the world. Returns their bodies.
  std::vector<b2Body*> own(b2World& world);
  // Creates the fixtures near dynamic bodies: those with which Box2D can create contacts in a step
  // of `dt` seconds; after the step, with 0, those at places that could not be predicted. The next
  // step searches for contacts with them.
  void create(b2World& world, float dt);
  // Destroys the fixtures near dynamic bodies, without contacts, but not their places in the broad
  // phase. These walls must be replaced afterwards.
  void destroy(b2World& world) const;

  // Returns the fixture of the world for one with the same id; null if it does not exist.
  b2Fixture* find(const b2Fixture& fixture) const;
  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [index, fixture] : near_) visit(*fixture);
  }

 private:
  const b2Fixture& create_one(b2World& world, std::size_t index);

  std::shared_ptr<const SharedWalls> shared_;
  std::unordered_map<Id, b2Body*> bodies_;  // with shared walls
  std::vector<bool> is_complete_;           // whether all fixtures of a cell exist
  std::map<std::size_t, b2Fixture*> near_;  // by index
};

}  // namespace flatland
