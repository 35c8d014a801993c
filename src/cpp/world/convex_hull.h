// The convex hull of a polygon, as Box2D computes it in single precision, and in double precision.
#pragma once

#include <box2d/b2_math.h>

#include <vector>

namespace flatland {

// Returns the points without those that are closer to an earlier point than half of the linear slop
// of Box2D, which drops these.
std::vector<b2Vec2> weld_points(const std::vector<b2Vec2>& points);

// Returns the hull that b2PolygonShape::Set computes for welded points, with the same rounding. If
// three points are almost collinear, a corner may be missing. Returns fewer than 3 points if there
// is no hull, or if the gift wrapping does not terminate because of rounding.
std::vector<b2Vec2> box2d_hull(const std::vector<b2Vec2>& points);

// Returns the corners of the hull in double precision, counter-clockwise from the same corner as
// Box2D. Corners that are almost on the line between their neighbours are omitted, and then those
// that are welded to an earlier one.
std::vector<b2Vec2> exact_hull(const std::vector<b2Vec2>& points);

// Returns whether a hull that Box2D has computed contains all corners of the exact hull, except for
// rounding.
bool has_corners(const std::vector<b2Vec2>& hull, const std::vector<b2Vec2>& corners);

}  // namespace flatland
