// What can be done with bodies and fixtures. All numbers are checked; see world.h for what is
// thrown beyond std::invalid_argument.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "world/world.h"

namespace flatland {

// (x, y, theta) or (vx, vy, omega), world frame [m, rad, s].
using Triple = std::array<double, 3>;

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

Triple pose_of(const World& world, Id body);
// Wakes the body, or those near it when it is static.
void set_pose(World& world, Id body, const Triple& pose);

// Velocity of the body's origin, not of its centre of mass.
Triple velocity_of(const World& world, Id body);
void set_velocity(World& world, Id body, const Triple& velocity);

void apply_force(World& world, Id body, double fx, double fy, double px, double py);
void apply_torque(World& world, Id body, double torque);

Id create_circle(World& world, Id body, double x, double y, double radius,
                 const FixtureOptions& options);
Id create_polygon(World& world, Id body, const std::vector<b2Vec2>& points,
                  const FixtureOptions& options);
// Makes one fixture for each row (x1, y1, x2, y2) that is not too short to have a direction, and
// returns how many. The caller holds the world exclusively.
std::size_t create_edges(World& world, Id body, const float* edges, std::size_t count,
                         const FixtureOptions& options);

// In order of creation.
std::vector<Id> fixtures_of(const World& world, Id body);
std::vector<Id> joints_of(const World& world, Id body);
// Rows (x1, y1, x2, y2) of the edge fixtures, body frame.
std::vector<std::array<float, 4>> edges_of(const World& world, Id body);

// Corners of a polygon (counter-clockwise) or ends of an edge, body frame; none for a circle.
std::vector<std::array<double, 2>> vertices_of(const b2Fixture& fixture);
// Centre of a circle, centroid of a polygon, middle of an edge, body frame.
b2Vec2 center_of(const b2Fixture& fixture);

void set_sensor(World& world, Id fixture, bool is_sensor);
void set_filter(World& world, Id fixture, std::uint16_t category_bits, std::uint16_t mask_bits);

}  // namespace flatland
