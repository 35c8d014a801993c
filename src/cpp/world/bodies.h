// Operations on bodies and fixtures. They throw std::invalid_argument if a number is invalid, and
// the exceptions described in world.h.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "world/triple.h"
#include "world/world.h"

namespace flatland {

struct FixtureOptions {
  double density = 0.0;
  double friction = 0.0;
  double restitution = 0.0;
  bool is_sensor = false;
  std::uint16_t category_bits = 0xFFFF;
  std::uint16_t mask_bits = 0xFFFF;
};

Id create_body(World& world, b2BodyType type, const Triple& pose, double linear_damping,
               double angular_damping);

b2Transform checked_pose(const Triple& pose);

Triple pose_of(const World& world, Id body);
Triple pose_of(const b2Body& body);
// Wakes the body, or the adjacent dynamic bodies if it is static.
void set_pose(World& world, Id body, const Triple& pose);
void set_pose(World& world, b2Body* body, const Triple& pose);

// Returns the velocity of the origin of a body, not of the center of mass.
Triple velocity_of(const World& world, Id body);
Triple velocity_of(const b2Body& body);
void set_velocity(World& world, Id body, const Triple& velocity);
void set_velocity(b2Body* body, const Triple& velocity);

// The state of a body in the numbers of Box2D: position of the origin (x, y) and angle, center of
// mass (x, y), velocity of the center of mass (vx, vy, omega), and 1 if the body is awake,
// otherwise 0.
using BodyState = std::array<float, 9>;
// Returns the states of all bodies, in order of creation.
std::vector<BodyState> states_of(const World& world);

// Returns the poses and velocities of the origins of bodies, one body after the other: x, y, theta,
// vx, vy, omega.
void motions_of(const World& world, const Id* bodies, std::size_t count, double* motions);

// Returns the moment of inertia about the center of mass [kg m^2], which Box2D stores only about
// the origin of the body. The result is computed in the type `Number`.
template <typename Number>
Number inertia_about_center(const b2Body& body) {
  return static_cast<Number>(body.GetInertia()) -
         static_cast<Number>(body.GetMass()) *
             static_cast<Number>(body.GetLocalCenter().LengthSquared());
}

void apply_force(World& world, Id body, double fx, double fy, double px, double py);
void apply_torque(World& world, Id body, double torque);

Id create_circle(World& world, Id body, double x, double y, double radius,
                 const FixtureOptions& options);
Id create_polygon(World& world, Id body, const std::vector<b2Vec2>& points,
                  const FixtureOptions& options);
// Creates a fixture for each row (x1, y1, x2, y2) that is not shorter than kMinEdgeLength, and
// returns the number of fixtures. The caller has exclusive use of the world.
std::size_t create_edges(World& world, Id body, const float* edges, std::size_t count,
                         const FixtureOptions& options);

// Return ids in order of creation.
std::vector<Id> fixtures_of(const World& world, Id body);
std::vector<Id> joints_of(const World& world, Id body);
// Returns the edge fixtures as rows (x1, y1, x2, y2) in the body frame.
std::vector<std::array<float, 4>> edges_of(const World& world, Id body);

// Returns the corners of a polygon (counter-clockwise) or the end points of an edge in the body
// frame; no points for a circle.
std::vector<b2Vec2> vertices_of(const b2Fixture& fixture);
// Returns the center of a circle, centroid of a polygon or midpoint of an edge in the body frame.
b2Vec2 center_of(const b2Fixture& fixture);

void set_sensor(World& world, Id fixture, bool is_sensor);
void set_filter(World& world, Id fixture, std::uint16_t category_bits, std::uint16_t mask_bits);
// Also sets the mass of the body. Throws std::invalid_argument if it would be out of range.
void set_density(World& world, Id fixture, double density);
// Also applies to present contacts.
void set_friction(World& world, Id fixture, double friction);
// Multiplies the lengths of all shapes by a factor, relative to the origin of the body, and sets
// its mass. Throws std::invalid_argument if a shape is an edge or the mass would be out of range.
void scale_shapes(World& world, Id body, double factor);

}  // namespace flatland
