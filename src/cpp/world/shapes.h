// Creation of Box2D shapes from checked numbers.
#pragma once

#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_polygon_shape.h>

#include <vector>

class b2Body;

namespace flatland {

// Box2D cannot compute the direction of shorter edges, and finds no collisions with such edges.
inline constexpr float kMinEdgeLength = b2_epsilon;

// Returns a circle; a circle of radius 0 is a point. Throws std::invalid_argument.
b2CircleShape make_circle(double x, double y, double radius);

// Returns the convex hull of 3 to 8 points: that of Box2D, bit by bit, or the exact one if a corner
// is missing from it. Throws std::invalid_argument if there are too few points, too few of them are
// distinct (Box2D welds points closer than 2.5 mm), or the hull has no area.
b2PolygonShape make_polygon(const std::vector<b2Vec2>& points);

// Sets a two-sided edge. Returns false if it is shorter than kMinEdgeLength.
bool make_edge(const float* x1_y1_x2_y2, b2EdgeShape* edge);

// A shape of a body with its density [kg/m^2].
struct MassivePart {
  const b2Shape* shape;
  float density;
};

// Throws std::invalid_argument if the mass or the moment of inertia of a dynamic body that consists
// of these shapes would be outside the range in which Box2D can compute.
void check_mass(const std::vector<MassivePart>& parts);
// The same for the shapes that a body has and an additional one; a body that is not dynamic has no
// mass.
void check_mass_with(const b2Body& body, const b2Shape& shape, float density);

// Throws std::invalid_argument if the shape is outside the range in which Box2D can compute, such
// as a polygon that is too small to have an area.
void check_shape(const b2CircleShape& circle);
void check_shape(const b2PolygonShape& polygon);

}  // namespace flatland
