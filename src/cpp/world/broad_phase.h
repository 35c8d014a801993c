// An optimization of the search for new pairs of fixtures in Box2D, for maps with hundreds of
// thousands of edges.
#pragma once

#include <box2d/b2_world.h>

namespace flatland {

// Returns the number of fixtures that are pending for the search for new pairs in the next step.
int32 pending_fixtures(const b2World& world);

// Removes the fixtures after the first `pending_before` ones, which must belong to one static body,
// from the search for new pairs.
//
// For a map with 800 000 edges the search would take more than a second, and would find only pairs
// of edges of the same body. Instead, the function makes all fixtures of dynamic bodies pending,
// which finds the same pairs of edges and bodies.
void skip_static_fixtures(b2World& world, int32 pending_before);

}  // namespace flatland
