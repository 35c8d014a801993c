#include "world/bodies.h"

#include <box2d/b2_contact.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "world/errors.h"
#include "world/shapes.h"

namespace flatland {
namespace {

b2FixtureDef checked_definition(const b2Shape& shape, const FixtureOptions& options) {
  b2FixtureDef definition;
  definition.shape = &shape;
  definition.density = checked_not_negative(options.density, "density");
  definition.friction = checked_not_negative(options.friction, "friction");
  definition.restitution = checked_not_negative(options.restitution, "restitution");
  definition.isSensor = options.is_sensor;
  definition.filter.categoryBits = options.category_bits;
  definition.filter.maskBits = options.mask_bits;
  return definition;
}

// Wakes the bodies that are affected by a new pose or shape of a body.
void wake(World& world, b2Body* body) {
  if (body->GetType() == b2_staticBody) {
    world.wake_neighbours(body);
  } else {
    body->SetAwake(true);
  }
}

Id create_fixture(World& world, Id body_id, const b2Shape& shape, const FixtureOptions& options) {
  b2Body* body = world.change_body(body_id);
  const b2FixtureDef definition = checked_definition(shape, options);
  check_mass_with(*body, shape, definition.density);
  const Id id = world.add_fixture(body, definition);
  wake(world, body);
  return id;
}

// Box2D stores fixtures and joints in lists with the newest first.
template <typename Value>
std::vector<Value> reversed(std::vector<Value> values) {
  std::reverse(values.begin(), values.end());
  return values;
}

// Checks that the change of velocity caused by a force in one second is in the valid range.
void check_acceleration(float acceleration, const char* what) {
  if (!(std::abs(static_cast<double>(acceleration)) <= kMaxMagnitude)) {
    throw std::invalid_argument(std::string(what) + " is too large for the mass of the body");
  }
}

using ScaledShape = std::variant<b2CircleShape, b2PolygonShape>;

// Returns a circle or a polygon whose lengths are multiplied by a factor. Throws
// std::invalid_argument if Box2D cannot compute with it.
ScaledShape scaled_shape(const b2Shape& shape, float scale) {
  if (shape.GetType() == b2Shape::e_circle) {
    b2CircleShape circle = static_cast<const b2CircleShape&>(shape);
    circle.m_p *= scale;
    circle.m_radius *= scale;
    check_shape(circle);
    return circle;
  }
  b2PolygonShape polygon = static_cast<const b2PolygonShape&>(shape);
  polygon.m_centroid *= scale;
  for (int32 i = 0; i < polygon.m_count; ++i) polygon.m_vertices[i] *= scale;
  check_shape(polygon);
  return polygon;
}

const b2Shape* shape_in(const ScaledShape& scaled) {
  return std::visit([](const auto& shape) -> const b2Shape* { return &shape; }, scaled);
}

// Accounts for a new density or friction. A copy of a world that is restored to another one sets
// those of moving bodies in any case.
void surface_changed(World& world, b2Body* body) {
  if (body->GetType() == b2_staticBody) world.structure_changed();
  wake(world, body);
}

}  // namespace

Id create_body(World& world, b2BodyType type, const Triple& pose, double linear_damping,
               double angular_damping) {
  b2BodyDef definition;
  definition.type = type;
  definition.position = checked_vector(pose[0], pose[1], "pose");
  definition.angle = checked_finite(pose[2], "pose angle");
  definition.linearDamping = checked_not_negative(linear_damping, "linear_damping");
  definition.angularDamping = checked_not_negative(angular_damping, "angular_damping");
  return world.add_body(definition);
}

b2Transform checked_pose(const Triple& pose) {
  b2Transform transform;
  transform.p = checked_vector(pose[0], pose[1], "pose");
  transform.q.Set(checked_finite(pose[2], "pose angle"));
  return transform;
}

Triple pose_of(const World& world, Id body_id) { return pose_of(*world.read_body(body_id)); }

Triple pose_of(const b2Body& body) {
  const b2Vec2& position = body.GetPosition();
  return {static_cast<double>(position.x), static_cast<double>(position.y),
          static_cast<double>(body.GetAngle())};
}

void set_pose(World& world, Id body_id, const Triple& pose) {
  set_pose(world, world.change_body(body_id), pose);
}

void set_pose(World& world, b2Body* body, const Triple& pose) {
  const b2Vec2 position = checked_vector(pose[0], pose[1], "pose");
  const float angle = checked_finite(pose[2], "pose angle");
  body->SetTransform(position, angle);
  if (body->GetType() == b2_staticBody) world.structure_changed();
  wake(world, body);
}

Triple velocity_of(const World& world, Id body_id) {
  return velocity_of(*world.read_body(body_id));
}

Triple velocity_of(const b2Body& body) {
  const b2Vec2 velocity = body.GetLinearVelocityFromWorldPoint(body.GetPosition());
  return {static_cast<double>(velocity.x), static_cast<double>(velocity.y),
          static_cast<double>(body.GetAngularVelocity())};
}

void set_velocity(World& world, Id body_id, const Triple& velocity) {
  set_velocity(world.change_body(body_id), velocity);
}

void set_velocity(b2Body* body, const Triple& velocity) {
  const b2Vec2 of_origin = checked_vector(velocity[0], velocity[1], "velocity");
  const float omega = checked_finite(velocity[2], "velocity omega");
  const b2Vec2 to_center = body->GetWorldCenter() - body->GetPosition();
  body->SetLinearVelocity(of_origin + b2Cross(omega, to_center));
  body->SetAngularVelocity(omega);
}

std::vector<BodyState> states_of(const World& world) {
  world.check_readable();
  std::vector<BodyState> states;
  states.reserve(static_cast<std::size_t>(world.engine().GetBodyCount()));
  for (const b2Body* body = world.engine().GetBodyList(); body != nullptr; body = body->GetNext()) {
    const b2Vec2& position = body->GetPosition();
    const b2Vec2& center = body->GetWorldCenter();
    const b2Vec2& velocity = body->GetLinearVelocity();
    states.push_back({position.x, position.y, body->GetAngle(), center.x, center.y, velocity.x,
                      velocity.y, body->GetAngularVelocity(), body->IsAwake() ? 1.0F : 0.0F});
  }
  // Box2D prepends new bodies to its list.
  std::reverse(states.begin(), states.end());
  return states;
}

void motions_of(const World& world, const Id* bodies, std::size_t count, double* motions) {
  for (std::size_t i = 0; i < count; ++i) {
    motions = std::copy_n(pose_of(world, bodies[i]).begin(), 3, motions);
    motions = std::copy_n(velocity_of(world, bodies[i]).begin(), 3, motions);
  }
}

void apply_force(World& world, Id body_id, double fx, double fy, double px, double py) {
  b2Body* body = world.change_body(body_id);
  const b2Vec2 force = checked_vector(fx, fy, "force");
  const b2Vec2 point = checked_vector(px, py, "point");
  const float mass = body->GetMass();
  float acceleration = 0.0F;
  float angular_acceleration = 0.0F;
  if (mass > 0.0F) {
    acceleration = force.Length() / mass;
    check_acceleration(acceleration, "force");
    const auto inertia = inertia_about_center<float>(*body);
    const float torque = b2Cross(point - body->GetWorldCenter(), force);
    if (inertia > 0.0F) angular_acceleration = torque / inertia;
    check_acceleration(angular_acceleration, "force");
  }
  body->ApplyForce(force, point, true);
  world.contacts().guard.add_acceleration(body_id, acceleration, std::abs(angular_acceleration));
}

void apply_torque(World& world, Id body_id, double torque) {
  b2Body* body = world.change_body(body_id);
  const float checked = checked_finite(torque, "torque");
  const auto inertia = inertia_about_center<float>(*body);
  const float acceleration = inertia > 0.0F ? checked / inertia : 0.0F;
  check_acceleration(acceleration, "torque");
  body->ApplyTorque(checked, true);
  world.contacts().guard.add_acceleration(body_id, 0.0F, std::abs(acceleration));
}

Id create_circle(World& world, Id body, double x, double y, double radius,
                 const FixtureOptions& options) {
  return create_fixture(world, body, make_circle(x, y, radius), options);
}

Id create_polygon(World& world, Id body, const std::vector<b2Vec2>& points,
                  const FixtureOptions& options) {
  return create_fixture(world, body, make_polygon(points), options);
}

std::size_t create_edges(World& world, Id body_id, const float* edges, std::size_t count,
                         const FixtureOptions& options) {
  check_all_finite(edges, 4 * count, 4, "edges");
  b2EdgeShape shape;
  const b2FixtureDef definition = checked_definition(shape, options);
  auto* body = const_cast<b2Body*>(world.read_body(body_id));
  world.reserve_fixtures(count);
  std::size_t made = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!make_edge(edges + 4 * i, &shape)) continue;
    world.add_fixture(body, definition);
    ++made;
  }
  if (made > 0) wake(world, body);
  return made;
}

std::vector<Id> fixtures_of(const World& world, Id body_id) {
  const b2Body* body = world.read_body(body_id);
  std::vector<Id> ids;
  for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
    ids.push_back(id_of(f));
  }
  return reversed(std::move(ids));
}

std::vector<Id> joints_of(const World& world, Id body_id) {
  const b2Body* body = world.read_body(body_id);
  std::vector<Id> ids;
  for (const b2JointEdge* edge = body->GetJointList(); edge != nullptr; edge = edge->next) {
    ids.push_back(edge->joint->GetUserData().pointer);
  }
  return reversed(std::move(ids));
}

std::vector<std::array<float, 4>> edges_of(const World& world, Id body_id) {
  const b2Body* body = world.read_body(body_id);
  std::vector<std::array<float, 4>> edges;
  for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (f->GetType() != b2Shape::e_edge) continue;
    const auto* edge = static_cast<const b2EdgeShape*>(f->GetShape());
    edges.push_back({edge->m_vertex1.x, edge->m_vertex1.y, edge->m_vertex2.x, edge->m_vertex2.y});
  }
  return reversed(std::move(edges));
}

std::vector<b2Vec2> vertices_of(const b2Fixture& fixture) {
  if (fixture.GetType() == b2Shape::e_polygon) {
    const auto* polygon = static_cast<const b2PolygonShape*>(fixture.GetShape());
    return {polygon->m_vertices, polygon->m_vertices + polygon->m_count};
  }
  if (fixture.GetType() == b2Shape::e_edge) {
    const auto* edge = static_cast<const b2EdgeShape*>(fixture.GetShape());
    return {edge->m_vertex1, edge->m_vertex2};
  }
  return {};
}

b2Vec2 center_of(const b2Fixture& fixture) {
  if (fixture.GetType() == b2Shape::e_circle) {
    return static_cast<const b2CircleShape*>(fixture.GetShape())->m_p;
  }
  if (fixture.GetType() == b2Shape::e_polygon) {
    return static_cast<const b2PolygonShape*>(fixture.GetShape())->m_centroid;
  }
  const auto* edge = static_cast<const b2EdgeShape*>(fixture.GetShape());
  return 0.5F * (edge->m_vertex1 + edge->m_vertex2);
}

void set_sensor(World& world, Id fixture_id, bool is_sensor) {
  b2Fixture* fixture = world.change_fixture(fixture_id);
  if (fixture->IsSensor() == is_sensor) return;
  fixture->SetSensor(is_sensor);
  world.fixture_changed(fixture);
}

void set_filter(World& world, Id fixture_id, std::uint16_t category_bits, std::uint16_t mask_bits) {
  b2Fixture* fixture = world.change_fixture(fixture_id);
  b2Filter filter = fixture->GetFilterData();
  filter.categoryBits = category_bits;
  filter.maskBits = mask_bits;
  fixture->SetFilterData(filter);
  world.fixture_changed(fixture);
}

void set_density(World& world, Id fixture_id, double density) {
  b2Fixture* fixture = world.change_fixture(fixture_id);
  b2Body* body = fixture->GetBody();
  const float checked = checked_not_negative(density, "density");
  const float before = fixture->GetDensity();
  fixture->SetDensity(0.0F);  // The check adds the shape with its new density.
  try {
    check_mass_with(*body, *fixture->GetShape(), checked);
  } catch (const std::invalid_argument&) {
    fixture->SetDensity(before);
    throw;
  }
  fixture->SetDensity(checked);
  body->ResetMassData();
  world.mass_changed(body);
  surface_changed(world, body);
}

void set_friction(World& world, Id fixture_id, double friction) {
  b2Fixture* fixture = world.change_fixture(fixture_id);
  b2Body* body = fixture->GetBody();
  fixture->SetFriction(checked_not_negative(friction, "friction"));
  for (b2ContactEdge* edge = body->GetContactList(); edge != nullptr; edge = edge->next) {
    edge->contact->ResetFriction();
  }
  surface_changed(world, body);
}

void scale_shapes(World& world, Id body_id, double factor) {
  b2Body* body = world.change_body(body_id);
  constexpr double kMin = 0.1;
  constexpr double kMax = 10.0;
  if (!(factor >= kMin && factor <= kMax)) {
    throw std::invalid_argument("factor must be from 0.1 to 10, got " + to_text(factor));
  }
  // Of the largest mass, with which Box2D can compute.
  constexpr double kMaxMass = 1e15;
  const double growth = std::max(factor * factor, std::pow(factor, 4.0));
  const auto mass = static_cast<double>(std::max(body->GetMass(), body->GetInertia()));
  if (mass * growth > kMaxMass) {
    throw std::invalid_argument("the mass of the body is too large for a factor of " +
                                to_text(factor));
  }
  for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (f->GetType() == b2Shape::e_circle || f->GetType() == b2Shape::e_polygon) continue;
    throw std::invalid_argument("the body has edges, which cannot be scaled");
  }
  // Nothing is changed unless all of the scaled shapes are valid.
  const auto scale = static_cast<float>(factor);
  std::deque<ScaledShape> scaled;
  std::vector<MassivePart> parts;
  for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
    scaled.push_back(scaled_shape(*f->GetShape(), scale));
    parts.push_back({shape_in(scaled.back()), f->GetDensity()});
  }
  if (body->GetType() == b2_dynamicBody) check_mass(parts);
  auto shape = scaled.begin();
  for (b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext(), ++shape) {
    if (f->GetType() == b2Shape::e_circle) {
      static_cast<b2CircleShape&>(*f->GetShape()) = std::get<b2CircleShape>(*shape);
    } else {
      static_cast<b2PolygonShape&>(*f->GetShape()) = std::get<b2PolygonShape>(*shape);
    }
  }
  body->ResetMassData();
  world.mass_changed(body);
  world.structure_changed();
  // Moves the boxes of the fixtures.
  body->SetTransform(body->GetPosition(), body->GetAngle());
  wake(world, body);
}

}  // namespace flatland
