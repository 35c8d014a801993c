#include "world/overlap.h"

#include <box2d/b2_body.h>
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_distance.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_joint.h>
#include <box2d/b2_polygon_shape.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "world/contacts.h"
#include "world/shared_walls.h"
#include "world/world.h"

namespace flatland {
namespace {

Hull hull_of(const b2Fixture& fixture) {
  Hull hull;
  switch (fixture.GetType()) {
    case b2Shape::e_circle: {
      const auto* circle = static_cast<const b2CircleShape*>(fixture.GetShape());
      hull.points[0] = circle->m_p;
      hull.count = 1;
      hull.radius = circle->m_radius;
      break;
    }
    case b2Shape::e_edge: {
      const auto* edge = static_cast<const b2EdgeShape*>(fixture.GetShape());
      hull.points[0] = edge->m_vertex1;
      hull.points[1] = edge->m_vertex2;
      hull.count = 2;
      b2Vec2 normal = b2Cross(edge->m_vertex2 - edge->m_vertex1, 1.0F);
      normal.Normalize();
      hull.normals[0] = normal;
      hull.normals[1] = -normal;
      hull.normal_count = 2;
      break;
    }
    case b2Shape::e_polygon: {
      const auto* polygon = static_cast<const b2PolygonShape*>(fixture.GetShape());
      hull.count = hull.normal_count = polygon->m_count;
      std::copy_n(polygon->m_vertices, hull.count, hull.points);
      std::copy_n(polygon->m_normals, hull.count, hull.normals);
      break;
    }
    default:  // no other shapes are created
      break;
  }
  return hull;
}

Hull moved(const Hull& hull, const b2Transform& pose) {
  Hull result = hull;
  for (int32 i = 0; i < hull.count; ++i) result.points[i] = b2Mul(pose, hull.points[i]);
  for (int32 i = 0; i < hull.normal_count; ++i) result.normals[i] = b2Mul(pose.q, hull.normals[i]);
  return result;
}

// Returns the maximum separation of the points of two hulls along the normals of the first one;
// negative if no side of the first hull separates them.
float separation_along_normals(const Hull& first, const Hull& second) {
  float greatest = -std::numeric_limits<float>::infinity();
  for (int32 i = 0; i < first.normal_count; ++i) {
    // Side i starts at point i; this also holds for the two sides of an edge.
    float least = std::numeric_limits<float>::infinity();
    for (int32 k = 0; k < second.count; ++k) {
      least = std::min(least, b2Dot(first.normals[i], second.points[k] - first.points[i]));
    }
    greatest = std::max(greatest, least);
  }
  return greatest;
}

// Returns whether the distance of two hulls in the same frame is less than `least_gap`. A negative
// distance is a penetration depth, the length of the shortest translation that separates the hulls.
bool are_closer(const Hull& a, const Hull& b, float least_gap) {
  const float least = least_gap + a.radius + b.radius;
  const float separation = std::max(separation_along_normals(a, b), separation_along_normals(b, a));
  if (separation >= least) return false;  // the separation is a lower bound of the distance
  // The separation is exact if a polygon overlaps; otherwise the distance of corners can be
  // greater.
  if (separation <= 0.0F && std::max(a.count, b.count) > 2) return true;
  b2DistanceInput input;
  input.proxyA.Set(a.points, a.count, 0.0F);
  input.proxyB.Set(b.points, b.count, 0.0F);
  input.transformA.SetIdentity();
  input.transformB.SetIdentity();
  input.useRadii = false;
  b2SimplexCache cache;
  cache.count = 0;
  b2DistanceOutput output;
  b2Distance(&output, &cache, &input);
  return output.distance < least;
}

bool filters_match(const b2Filter& a, const b2Filter& b) {
  return (a.maskBits & b.categoryBits) != 0 && (a.categoryBits & b.maskBits) != 0;
}

// Equivalent to b2Body::ShouldCollide, which is private.
bool bodies_collide(const b2Body* probe, const b2Body& other) {
  if (probe == nullptr) return true;
  if (probe->GetType() != b2_dynamicBody && other.GetType() != b2_dynamicBody) return false;
  for (const b2JointEdge* edge = probe->GetJointList(); edge != nullptr; edge = edge->next) {
    if (edge->other == &other && !edge->joint->GetCollideConnected()) return false;
  }
  return true;
}

// Finds all bodies that a part of a probe overlaps, or only the first body.
class FindOverlaps final : public b2QueryCallback {
 public:
  FindOverlaps(const Probe& probe, bool all) : probe_(probe), all_(all) {}

  void find(const Engines& engines, const ProbePart& part, const b2Transform& pose) {
    part_ = &part;
    hull_ = moved(part.hull, pose);
    b2AABB box{hull_.points[0], hull_.points[0]};
    for (int32 i = 1; i < hull_.count; ++i) {
      box.lowerBound = b2Min(box.lowerBound, hull_.points[i]);
      box.upperBound = b2Max(box.upperBound, hull_.points[i]);
    }
    const float margin = hull_.radius + std::max(probe_.least_gap, 0.0F);
    box.lowerBound -= b2Vec2(margin, margin);
    box.upperBound += b2Vec2(margin, margin);
    engines.for_each([&](const b2World& engine) { engine.QueryAABB(this, box); });
  }

  bool ReportFixture(b2Fixture* fixture) override {
    const b2Body* body = fixture->GetBody();
    if (is_relevant(*fixture) &&
        are_closer(hull_, moved(hull_of(*fixture), body->GetTransform()), probe_.least_gap)) {
      found.push_back(id_of(fixture->GetBody()));
      return all_;
    }
    return true;
  }

  std::vector<Id> found;

 private:
  bool is_relevant(const b2Fixture& fixture) const {
    const b2Body* body = fixture.GetBody();
    const auto contains = [body](const std::vector<Id>& bodies) {
      return std::binary_search(bodies.begin(), bodies.end(), id_of(body));
    };
    // Edges do not collide with edges.
    const bool are_edges = part_->hull.count == 2 && fixture.GetType() == b2Shape::e_edge;
    return !fixture.IsSensor() && !are_edges &&
           filters_match(part_->filter, fixture.GetFilterData()) && !contains(probe_.ignored) &&
           (!probe_.only || contains(*probe_.only)) && bodies_collide(part_->body, *body);
  }

  const Probe& probe_;
  const bool all_;
  const ProbePart* part_ = nullptr;
  Hull hull_;  // of the part, world frame
};

}  // namespace

std::vector<Id> sorted_bodies(const World& world, std::vector<Id> ids) {
  for (const Id id : ids) world.read_body(id);  // throws if it does not exist
  std::sort(ids.begin(), ids.end());
  return ids;
}

Probe probe_of_bodies(const World& world, const std::vector<Id>& bodies) {
  if (bodies.empty()) throw std::invalid_argument("bodies must not be empty");
  Probe probe;
  const b2Transform& origin = world.read_body(bodies.front())->GetTransform();
  for (const Id id : bodies) {
    const b2Body* body = world.read_body(id);
    const b2Transform pose = b2MulT(origin, body->GetTransform());
    for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
      if (!f->IsSensor())
        probe.parts.push_back({moved(hull_of(*f), pose), f->GetFilterData(), body});
    }
  }
  return probe;
}

Probe probe_of_disc(float radius, std::uint16_t bits) {
  ProbePart disc{};
  disc.hull.points[0].SetZero();
  disc.hull.count = 1;
  disc.hull.radius = radius;
  disc.filter.categoryBits = disc.filter.maskBits = bits;
  Probe probe;
  probe.parts.push_back(disc);
  return probe;
}

std::vector<Id> overlapping_bodies(const Engines& engines, const Probe& probe,
                                   const b2Transform& pose) {
  FindOverlaps finder(probe, true);
  for (const ProbePart& part : probe.parts) finder.find(engines, part, pose);
  std::sort(finder.found.begin(), finder.found.end());
  finder.found.erase(std::unique(finder.found.begin(), finder.found.end()), finder.found.end());
  return std::move(finder.found);
}

void find_free_poses(const Engines& engines, const Probe& probe, const double* poses,
                     std::size_t count, bool* is_free) {
  FindOverlaps finder(probe, false);
  for (std::size_t i = 0; i < count; ++i) {
    const double* values = poses + 3 * i;
    const b2Transform pose(b2Vec2(static_cast<float>(values[0]), static_cast<float>(values[1])),
                           b2Rot(static_cast<float>(values[2])));
    finder.found.clear();
    for (const ProbePart& part : probe.parts) {
      finder.find(engines, part, pose);
      if (!finder.found.empty()) break;
    }
    is_free[i] = finder.found.empty();
  }
}

}  // namespace flatland
