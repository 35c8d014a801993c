// Finds the bodies that a set of shapes would overlap at given poses.
//
// Only pairs of fixtures that can collide are considered: neither is a sensor, their filter bits
// match, at least one body is dynamic, and no joint prevents the collision. The distance of two
// shapes excludes the polygon radius of Box2D.
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

namespace flatland {

class World;
struct Engines;

// The convex hull of up to 8 points, enlarged by a radius; represents circles, edges and polygons.
struct Hull {
  b2Vec2 points[b2_maxPolygonVertices];
  b2Vec2 normals[b2_maxPolygonVertices];  // outward normals of the sides, two for an edge
  int32 count = 0;
  int32 normal_count = 0;
  float radius = 0.0F;
};

// A solid shape of a probe, in the frame of the probe.
struct ProbePart {
  Hull hull;
  b2Filter filter;
  const b2Body* body;  // null for a shape without a body, which collides like a dynamic body
};

// A rigid set of shapes, and the bodies that they may overlap.
struct Probe {
  std::vector<ProbePart> parts;
  std::vector<Id> ignored;              // bodies, sorted; includes those of the probe
  std::optional<std::vector<Id>> only;  // bodies that are considered, sorted
  float least_gap = 0.0F;               // [m] distance below which shapes overlap; may be negative
};

// Returns the solid fixtures of bodies at their current relative poses, in the frame of the first
// body. Throws StaleHandleError, WorldLockedError, or std::invalid_argument if there are no bodies.
Probe probe_of_bodies(const World& world, const std::vector<Id>& bodies);

// Returns a disc around the origin with the same category and mask bits.
Probe probe_of_disc(float radius, std::uint16_t bits);

// Returns the ids of bodies, sorted. Throws StaleHandleError or WorldLockedError.
std::vector<Id> sorted_bodies(const World& world, std::vector<Id> ids);

// Returns the sorted, unique ids of the bodies that the probe overlaps at a pose.
std::vector<Id> overlapping_bodies(const Engines& engines, const Probe& probe,
                                   const b2Transform& pose);

// Determines for each of `count` poses (x, y, theta) whether the probe overlaps no body.
void find_free_poses(const Engines& engines, const Probe& probe, const double* poses,
                     std::size_t count, bool* is_free);

}  // namespace flatland
