#include "world/shapes.h"

#include <box2d/b2_body.h>
#include <box2d/b2_fixture.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "vec.h"
#include "world/convex_hull.h"
#include "world/errors.h"

namespace flatland {
namespace {

// A bound of the rounding error of an area or a moment of inertia, relative to the largest summand.
constexpr float kRounding = 4.0F * b2_epsilon;

bool has_area(const b2Vec2* hull, std::size_t count) {
  if (count < 3) return false;
  float area = 0.0F;
  float longest = 0.0F;
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const b2Vec2 a = hull[i] - hull[0];
    const b2Vec2 b = hull[i + 1] - hull[0];
    area += 0.5F * b2Cross(a, b);
    longest = std::max({longest, a.LengthSquared(), b.LengthSquared()});
  }
  return area > std::max(2.0F * b2_epsilon, kRounding * longest);
}

// Returns the polygon with these corners, which form a convex polygon in this order. Box2D would
// compute the hull of the corners again, with a rounding error that can lose a corner.
b2PolygonShape polygon_of(const std::vector<b2Vec2>& corners) {
  b2PolygonShape polygon;
  polygon.m_count = static_cast<int32>(corners.size());
  const Vec origin = to_vec(corners[0]);
  Vec moment;
  double sum = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const b2Vec2 next = corners[(i + 1) % corners.size()];
    b2Vec2 normal = b2Cross(next - corners[i], 1.0F);
    normal.Normalize();
    polygon.m_vertices[i] = corners[i];
    polygon.m_normals[i] = normal;
    const Vec a = to_vec(corners[i]) - origin;
    const Vec b = to_vec(next) - origin;
    moment += cross(a, b) / 3.0 * (a + b);
    sum += cross(a, b);
  }
  const Vec centroid = origin + moment / sum;
  polygon.m_centroid.Set(static_cast<float>(centroid.x), static_cast<float>(centroid.y));
  return polygon;
}

}  // namespace

b2CircleShape make_circle(double x, double y, double radius) {
  b2CircleShape circle;
  circle.m_p = checked_vector(x, y, "center");
  circle.m_radius = checked_not_negative(radius, "radius");
  return circle;
}

b2PolygonShape make_polygon(const std::vector<b2Vec2>& points) {
  if (points.size() < 3 || points.size() > static_cast<std::size_t>(b2_maxPolygonVertices)) {
    throw std::invalid_argument("a polygon must have 3 to 8 points, got " +
                                std::to_string(points.size()));
  }
  const std::vector<b2Vec2> corners = exact_hull(points);
  const std::vector<b2Vec2> distinct = weld_points(points);
  const std::vector<b2Vec2> hull = box2d_hull(distinct);
  if (has_area(corners.data(), corners.size()) && !has_corners(hull, corners))
    return polygon_of(corners);
  if (distinct.size() < 3) {
    throw std::invalid_argument(
        "a polygon must have at least 3 points that are at least 2.5 mm apart, got " +
        std::to_string(distinct.size()));
  }
  if (!has_area(hull.data(), hull.size())) {
    throw std::invalid_argument(
        "a polygon must have a positive area, but its points are collinear");
  }
  b2PolygonShape polygon;
  polygon.Set(points.data(), static_cast<int32>(points.size()));
  return polygon;
}

bool make_edge(const float* x1_y1_x2_y2, b2EdgeShape* edge) {
  const b2Vec2 from(x1_y1_x2_y2[0], x1_y1_x2_y2[1]);
  const b2Vec2 to(x1_y1_x2_y2[2], x1_y1_x2_y2[3]);
  if (!((to - from).Length() >= kMinEdgeLength)) return false;
  edge->SetTwoSided(from, to);
  return true;
}

void check_shape(const b2CircleShape& circle) {
  make_circle(static_cast<double>(circle.m_p.x), static_cast<double>(circle.m_p.y),
              static_cast<double>(circle.m_radius));
}

void check_shape(const b2PolygonShape& polygon) {
  for (int32 i = 0; i < polygon.m_count; ++i) {
    const b2Vec2& corner = polygon.m_vertices[i];
    checked_vector(static_cast<double>(corner.x), static_cast<double>(corner.y), "corner");
  }
  if (!has_area(polygon.m_vertices, static_cast<std::size_t>(polygon.m_count))) {
    throw std::invalid_argument("a polygon is too small to have an area");
  }
}

void check_mass(const std::vector<MassivePart>& parts) {
  constexpr float kMin = 1e-20F;
  constexpr float kMax = 1e15F;
  float mass = 0.0F;
  float inertia = 0.0F;
  b2Vec2 center(0.0F, 0.0F);
  for (const MassivePart& part : parts) {
    if (part.density == 0.0F) continue;
    b2MassData data;
    part.shape->ComputeMass(&data, part.density);
    mass += data.mass;
    center += data.mass * data.center;
    inertia += data.I;
  }
  if (mass == 0.0F && inertia == 0.0F) return;  // a point
  if (!(mass >= kMin && mass <= kMax)) {
    throw std::invalid_argument("the mass of a body must be 0 or from 1e-20 to 1e15 kg, got " +
                                to_text(static_cast<double>(mass)));
  }
  center *= 1.0F / mass;
  const float central_inertia = inertia - mass * b2Dot(center, center);
  if (!(inertia <= kMax && central_inertia >= kMin && central_inertia > kRounding * inertia)) {
    throw std::invalid_argument(
        "the moment of inertia of a body about its center of mass must be from 1e-20 to "
        "1e15 kg m^2 and not negligible compared to that about its origin, got " +
        to_text(static_cast<double>(central_inertia)) + " and " +
        to_text(static_cast<double>(inertia)) +
        " (a shape may be too small and too far from the origin of the body)");
  }
}

void check_mass_with(const b2Body& body, const b2Shape& shape, float density) {
  if (body.GetType() != b2_dynamicBody || density == 0.0F) return;
  // The sum has the order of Box2D, the newest fixture first.
  std::vector<MassivePart> parts{{&shape, density}};
  for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    parts.push_back({f->GetShape(), f->GetDensity()});
  }
  check_mass(parts);
}

}  // namespace flatland
