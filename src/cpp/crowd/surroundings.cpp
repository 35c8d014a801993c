#include "crowd/surroundings.h"

#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_polygon_shape.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "angles.h"
#include "world/contacts.h"

namespace flatland::crowd {
namespace {

constexpr int kCircleCorners = 24;  // number of corners of the polygon around a static circle

Vec in_world(const b2Body& body, b2Vec2 point) { return to_vec(body.GetWorldPoint(point)); }

std::vector<Vec> corners_of(const b2Body& body, const b2PolygonShape& polygon) {
  std::vector<Vec> corners;
  for (int32 i = 0; i < polygon.m_count; ++i) {
    corners.push_back(in_world(body, polygon.m_vertices[i]));
  }
  return corners;
}

}  // namespace

double Obstacle::gap(Vec p, Vec& away) const {
  if (corners.empty()) {
    away = unit(p - center, {1.0, 0.0});
    return length(p - center) - radius;
  }
  // Inside, the gap is the negative distance to the nearest side; outside, the distance to the
  // nearest point.
  double depth = -std::numeric_limits<double>::infinity();
  double nearest = std::numeric_limits<double>::infinity();
  Vec normal_inside;
  Vec nearest_point;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Segment side{corners[i], corners[(i + 1) % corners.size()]};
    const Vec normal = -left_of(unit(side.b - side.a, {1.0, 0.0}));
    const double height = dot(normal, p - side.a);
    if (height > depth) {
      depth = height;
      normal_inside = normal;
    }
    const Vec point = nearest_on(side, p);
    if (square(point - p) < nearest) {
      nearest = square(point - p);
      nearest_point = point;
    }
  }
  if (depth <= 0.0) {
    away = normal_inside;
    return depth;
  }
  away = unit(p - nearest_point, normal_inside);
  return std::sqrt(nearest);
}

Surroundings::Key Surroundings::key_of(const b2Body& body) {
  return {{id_of(&body), id_of(body.GetFixtureList())},
          {body.GetPosition().x, body.GetPosition().y, body.GetAngle()}};
}

bool Surroundings::counts(const b2Fixture& fixture) const {
  const b2Filter& filter = fixture.GetFilterData();
  return !fixture.IsSensor() && (filter.categoryBits & bits_) != 0 && filter.maskBits != 0;
}

bool Surroundings::read(const b2World& engine, const IdSet& own) {
  fixed_.clear();
  obstacles_.clear();
  for (const b2Body* body = engine.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (body->GetFixtureList() == nullptr || own.contains(id_of(body))) continue;
    if (body->GetType() == b2_staticBody) {
      fixed_.push_back(body);
    } else {
      add_obstacles(*body);
    }
  }
  const auto is_known = [](const Key& key, const b2Body* body) { return key == key_of(*body); };
  if (std::equal(keys_.begin(), keys_.end(), fixed_.begin(), fixed_.end(), is_known)) return false;
  std::vector<Segment> segments;
  keys_.clear();
  for (const b2Body* body : fixed_) {
    add_segments(*body, segments);
    keys_.push_back(key_of(*body));
  }
  all_.reset();
  walls_ = std::make_shared<const Walls>(std::move(segments), walls_->reach());
  return true;
}

void Surroundings::restrict_to(const std::optional<Box>& box) {
  if (!box && all_ == nullptr) return;
  if (all_ == nullptr) all_ = std::make_shared<const std::vector<Segment>>(walls_->segments());
  walls_ = std::make_shared<const Walls>(box ? clipped(*all_, *box) : *all_, walls_->reach());
  if (!box) all_.reset();
}

void Surroundings::extend(double reach) {
  if (reach > walls_->reach()) {
    walls_ = std::make_shared<const Walls>(walls_->segments(), reach);
  }
}

void Surroundings::add_segments(const b2Body& body, std::vector<Segment>& segments) const {
  for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (!counts(*f)) continue;
    std::vector<Vec> corners;
    if (f->GetType() == b2Shape::e_edge) {
      const auto& edge = static_cast<const b2EdgeShape&>(*f->GetShape());
      segments.push_back({in_world(body, edge.m_vertex1), in_world(body, edge.m_vertex2)});
    } else if (f->GetType() == b2Shape::e_polygon) {
      corners = corners_of(body, static_cast<const b2PolygonShape&>(*f->GetShape()));
    } else if (f->GetType() == b2Shape::e_circle) {
      const auto& circle = static_cast<const b2CircleShape&>(*f->GetShape());
      const Vec center = in_world(body, circle.m_p);
      const double radius = static_cast<double>(circle.m_radius) / std::cos(kPi / kCircleCorners);
      for (int i = 0; i < kCircleCorners; ++i) {
        const double angle = kTwoPi * i / kCircleCorners;
        corners.push_back(center + radius * Vec{std::cos(angle), std::sin(angle)});
      }
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
      segments.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
  }
}

void Surroundings::add_obstacles(const b2Body& body) {
  for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (!counts(*f)) continue;
    Obstacle obstacle;
    if (f->GetType() == b2Shape::e_circle) {
      const auto& circle = static_cast<const b2CircleShape&>(*f->GetShape());
      obstacle.center = in_world(body, circle.m_p);
      obstacle.radius = static_cast<double>(circle.m_radius);
    } else if (f->GetType() == b2Shape::e_polygon) {
      const auto& polygon = static_cast<const b2PolygonShape&>(*f->GetShape());
      obstacle.corners = corners_of(body, polygon);
      obstacle.center = in_world(body, polygon.m_centroid);
      for (const Vec corner : obstacle.corners) {
        obstacle.radius = std::max(obstacle.radius, length(corner - obstacle.center));
      }
    } else {
      continue;  // only layers have edges, and layers are static
    }
    obstacle.origin = to_vec(body.GetPosition());
    obstacle.velocity = to_vec(body.GetLinearVelocityFromLocalPoint({0.0F, 0.0F}));
    obstacle.omega = static_cast<double>(body.GetAngularVelocity());
    obstacle.is_dynamic = body.GetType() == b2_dynamicBody;
    obstacles_.push_back(std::move(obstacle));
  }
}

}  // namespace flatland::crowd
