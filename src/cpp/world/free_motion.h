// Moves bodies that nothing can touch in a step without the solver of Box2D.
//
// Most bodies of most steps are free: they have no joints, touch nothing, and stay clear of all
// fixtures whose boxes are near. For such a body, b2Island::Solve only integrates its forces and
// velocity, and the handling of impacts finds none. The same operations in the same order, without
// the lists of the solver, give the same numbers bit by bit.
#pragma once

#include <box2d/b2_body.h>

#include <vector>

class b2World;

namespace flatland {

class FreeMotion {
 public:
  // Moves all free bodies. To be called immediately before b2World::Step with the same arguments,
  // which then ignores them.
  //
  // Returns whether b2World::Step has nothing left to do, and must not be called.
  bool begin(b2World& world, float dt, int position_iterations);
  // Must be called after b2World::Step, or in its place.
  void end();

 private:
  std::vector<b2Body*> moved_;
};

}  // namespace flatland
