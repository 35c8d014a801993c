// Box2D shapes from numbers that have been checked.
#pragma once

#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_polygon_shape.h>

#include <vector>

class b2Body;

namespace flatland {

// Edges shorter than this have no direction that Box2D can compute; nothing ever hits them.
inline constexpr float kMinEdgeLength = b2_epsilon;

// A circle; a radius of 0 makes a point. Throws std::invalid_argument.
b2CircleShape make_circle(double x, double y, double radius);

// The convex hull of 3 to 8 points. Throws std::invalid_argument when points are too few, too
// near each other (Box2D joins points closer than 2.5 mm), or without area.
b2PolygonShape make_polygon(const std::vector<b2Vec2>& points);

// A two-sided edge; false when it is too short to have a direction.
bool make_edge(const float* x1_y1_x2_y2, b2EdgeShape* edge);

// Throws std::invalid_argument when a body would get a mass or inertia that a float cannot hold or
// that Box2D cannot compute with, once this shape is added.
void check_mass_with(const b2Body& body, const b2Shape& shape, float density);

}  // namespace flatland
