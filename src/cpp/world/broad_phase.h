// A short cut through Box2D's search for pairs, for maps of hundreds of thousands of edges.
#pragma once

#include <box2d/b2_world.h>

namespace flatland {

// How many fixtures wait for the search for pairs at the beginning of the next step.
int32 waiting_fixtures(const b2World& world);

// Takes the fixtures that came to wait since then, all of one static body, out of the search.
//
// The search would look for the neighbours of each of them, more than a second for a map of 800 000
// edges, only to find that they belong to the same body. Instead the fixtures of dynamic bodies
// wait, which finds the same pairs from the other side.
void skip_static_fixtures(b2World& world, int32 waiting_before);

}  // namespace flatland
