// The broad phase of Box2D, with a faster search for new pairs of fixtures, for maps with thousands
// of edges.
#pragma once

#include <box2d/b2_world.h>

namespace flatland {

// Returns the broad phase of a world, to which Box2D gives only constant access.
b2BroadPhase& broad_phase_of(const b2World& world);

// Returns the number of fixtures that are pending for the search for new pairs in the next step.
int32 pending_fixtures(const b2World& world);

// Searches for new pairs of the pending fixtures, with the result of
// b2ContactManager::FindNewContacts, including the order of the new contacts.
//
// Nearly all pairs that Box2D finds around the edges of a map are pairs of edges, of which it makes
// no contacts. The function withdraws the static fixtures that no dynamic fixture is near to.
void find_new_pairs(b2World& world);

// Does what b2World::Step does first. To be called immediately before.
void begin_step(b2World& world);

}  // namespace flatland
