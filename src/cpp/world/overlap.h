// Which fixtures a set of shapes would overlap at poses where it does not stand yet.
//
// Only pairs that the solver would collide count: no sensors, filter bits that match, at least one
// dynamic body, no joint that excludes the collision. Shapes are measured without the skin that
// Box2D puts around polygons and edges.
#pragma once

#include <box2d/b2_collision.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_math.h>
#include <box2d/b2_settings.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "world/slot_map.h"

class b2World;

namespace flatland {

class World;

// The convex hull of up to 8 points with a radius around it: every shape of Box2D that can collide.
struct Hull {
  b2Vec2 points[b2_maxPolygonVertices];
  b2Vec2 normals[b2_maxPolygonVertices];  // outward, of the sides; both sides of an edge
  int32 count = 0;
  int32 normal_count = 0;
  float radius = 0.0F;
};

// A solid shape of a probe, in the frame of the probe.
struct ProbePart {
  Hull hull;
  b2Filter filter;
  const b2Body* body;  // null for a shape that belongs to no body: it collides like a dynamic one
};

// Shapes that move together, and the bodies that they may overlap.
struct Probe {
  std::vector<ProbePart> parts;
  std::vector<const b2Body*> ignored;              // sorted; the bodies of the probe are among them
  std::optional<std::vector<const b2Body*>> only;  // sorted; all other bodies are ignored, too
  float least_gap = 0.0F;  // [m] two shapes closer than this overlap; may be negative
};

// The solid fixtures of some bodies as they stand to each other now, in the frame of the first one.
// Throws StaleHandleError, WorldLockedError, and std::invalid_argument when there is no body.
Probe probe_of_bodies(const World& world, const std::vector<Id>& bodies);

// A disc around the origin that belongs to some categories and collides with the same ones.
Probe probe_of_disc(float radius, std::uint16_t bits);

// The bodies of some ids, sorted. Throws as above.
std::vector<const b2Body*> sorted_bodies(const World& world, const std::vector<Id>& ids);

// Ids of the bodies that the probe overlaps at a pose, in order of the ids, each once.
std::vector<Id> overlapping_bodies(const b2World& world, const Probe& probe,
                                   const b2Transform& pose);

// For each of `count` poses (x, y, theta) whether the probe overlaps nothing there.
void find_free_poses(const b2World& world, const Probe& probe, const double* poses,
                     std::size_t count, bool* is_free);

}  // namespace flatland
