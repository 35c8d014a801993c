// The motions of all bodies, which are saved to undo changes of poses exactly.
#pragma once

#include <vector>

#include "world/world.h"

namespace flatland {

// Pose, velocity and sleep of a body in the numbers of Box2D.
struct SavedMotion {
  Id body = 0;
  b2Transform transform;
  b2Sweep sweep;
  b2Vec2 linear_velocity;
  float angular_velocity = 0.0F;
  float sleep_time = 0.0F;
  bool awake = false;
};

std::vector<SavedMotion> saved_motions(const World& world);

// Restores the motions bit by bit. Bodies that were destroyed in the meantime are ignored; the
// motion of bodies that were created in the meantime does not change.
void restore_motions(World& world, const std::vector<SavedMotion>& motions);

}  // namespace flatland
