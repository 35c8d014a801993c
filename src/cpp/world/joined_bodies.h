// Bodies that are connected by joints, directly or through others.
#pragma once

#include "world/triple.h"

class b2Body;

namespace flatland {

class World;

// Moves a body to a pose in the world frame, with all bodies that joints connect to it, except
// static ones. Their poses relative to the body do not change, and they stand afterwards.
void place_with_joined(World& world, b2Body* body, const Triple& pose);

}  // namespace flatland
