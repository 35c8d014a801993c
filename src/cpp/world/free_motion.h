// Moves bodies that nothing can touch in a step without the solver of Box2D.
//
// Most bodies of most steps are free: they have no joints, touch nothing, and stay clear of all
// fixtures whose boxes are near. For such a body, b2Island::Solve only integrates its forces and
// velocity, and the handling of impacts finds none. The same operations in the same order, without
// the lists of the solver, give the same numbers bit by bit.
//
// A body that leaves its boxes in the broad phase may get new contacts. Only a kinematic body can
// be free then, since its contacts are those with dynamic bodies, which are few compared to walls.
//
// A kinematic body that has no contacts and will not leave its boxes for some steps may coast: its
// state stays as it is, until all these steps are carried out at once. For Box2D it sleeps,
// as all bodies that are moved here.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_collision.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "world/bodies_by_type.h"

class b2World;
struct b2FixtureProxy;

namespace flatland {
namespace free_motion {

// Bodies with more fixtures than this are left to Box2D.
inline constexpr std::size_t kMostFixtures = 8;

struct FreeState {
  b2Vec2 center;
  float angle = 0.0F;
  b2Vec2 velocity;
  float omega = 0.0F;
  float sleep_time = 0.0F;
};

// A fixture that moves, its new box, and the displacement of the box.
struct MovedBox {
  b2FixtureProxy* proxy;
  b2AABB box;
  b2Vec2 displacement;
};

// The motion of a free body in a step.
struct Move {
  Move() {}  // does not initialize the boxes, which are many

  b2Body* body = nullptr;
  FreeState state;
  b2Transform to;
  std::array<MovedBox, kMostFixtures> boxes;
  std::size_t count = 0;
  bool are_kept = true;  // whether the broad phase keeps its boxes of all fixtures
};

}  // namespace free_motion

class FreeMotion {
 public:
  // Moves all free bodies. To be called immediately before b2World::Step with the same arguments,
  // which then ignores them. Bodies may begin to coast if `may_coast` is set.
  //
  // Returns whether b2World::Step has nothing left to do, and must not be called.
  bool begin(b2World& world, const BodiesByType& bodies, float dt, int position_iterations,
             bool may_coast);
  // Must be called after b2World::Step, or in its place.
  void end();
  // Carries out the steps of all bodies that coast. Must be called between two steps before code
  // reads or changes a kinematic body, and before dt changes.
  void catch_up();

 private:
  struct Coasting {
    b2Body* body;
    std::int64_t begin;  // number of steps at whose end the body has its present state
    std::int64_t end;    // number of steps at whose end the body may leave its boxes
    bool is_turning;     // whether the rotation has an effect on its boxes
  };
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  // Makes a body coast from this step on, if this is possible for more than one step.
  bool start_coasting(b2Body& body);
  // Carries out the steps of the coasting bodies that satisfy a condition.
  template <typename Condition>
  void finish(Condition condition);

  std::vector<b2Body*> moved_;
  std::vector<free_motion::Move> leaving_;

  std::vector<Coasting> coasting_;
  std::int64_t step_ = 0;           // number of steps begun
  std::int64_t next_end_ = kNever;  // the least one of `coasting_`
  int pause_ = 0;                   // number of steps in which no body begins to coast
  // Of the last step.
  b2World* world_ = nullptr;
  float dt_ = 0.0F;
};

}  // namespace flatland
