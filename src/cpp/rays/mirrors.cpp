#include "rays/mirrors.h"

#include <box2d/b2_body.h>
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_polygon_shape.h>

#include <algorithm>
#include <utility>

namespace flatland {
namespace {

using Word = std::uint32_t __attribute__((may_alias));

// Returns the face of a polygon next to a point in the world frame; 0 for other shapes.
std::int32_t face_at(const b2Fixture& fixture, const b2Vec2& point) {
  if (fixture.GetType() != b2Shape::e_polygon) return 0;
  const auto* polygon = static_cast<const b2PolygonShape*>(fixture.GetShape());
  const b2Vec2 p_body = b2MulT(fixture.GetBody()->GetTransform(), point);
  std::int32_t face = 0;
  float highest = -b2_maxFloat;
  for (std::int32_t i = 0; i < polygon->m_count; ++i) {
    const float height = b2Dot(polygon->m_normals[i], p_body - polygon->m_vertices[i]);
    if (height > highest) {
      highest = height;
      face = i;
    }
  }
  return face;
}

}  // namespace

const std::vector<Mirror>& MirroredRays::find(const RayScene& scene, const BeamFan& fan,
                                              const b2Transform& pose, const ScanBuffer& hits) {
  collect(hits, fan.count());
  mirrors_.clear();
  runs_.clear();
  std::uint32_t slot = HitRules::kNoFixture;
  std::int32_t face = -1;
  bool is_polygon = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const std::uint32_t ray = rays_[i];
    const bool is_same = hits.slots()[ray] == slot;
    if (is_same && !is_polygon) continue;
    slot = hits.slots()[ray];
    const b2Fixture& fixture = *scene.fixture_at(slot);
    is_polygon = fixture.GetType() == b2Shape::e_polygon;
    const b2Vec2 end = hits.fraction[ray] * b2Vec2(fan.x()[ray], fan.y()[ray]);
    const std::int32_t previous = std::exchange(face, face_at(fixture, b2Mul(pose, end)));
    if (!is_same || face != previous) runs_.push_back({index_of(slot, face), i});
  }
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    mirrors_[runs_[i].mirror].count += end_of(i) - runs_[i].begin;
  }
  group();
  return mirrors_;
}

// Collects the rays that are reflected, in reverse order.
void MirroredRays::collect(const ScanBuffer& hits, std::size_t count) {
  const auto* brightness = reinterpret_cast<const Word*>(hits.brightness.data());
  rays_.resize(count);
  std::uint32_t* rays = rays_.data();
  std::uint32_t found = 0;
  for (std::size_t i = count; i-- > 0;) {
    rays[found] = static_cast<std::uint32_t>(i);
    // Only the brightness of a reflected ray is negative. The loop has no branch: reflections may
    // be random, and a branch could not be predicted.
    found += brightness[i] >> 31U;
  }
  count_ = found;
}

// Makes the rays of each mirror consecutive.
void MirroredRays::group() {
  const bool is_grouped = runs_.size() == mirrors_.size();
  grouped_.resize(is_grouped ? 0 : count_);
  std::uint32_t* next = is_grouped ? rays_.data() : grouped_.data();
  for (Mirror& mirror : mirrors_) {
    mirror.rays = next;
    next += mirror.count;
    mirror.count = 0;
  }
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    Mirror& mirror = mirrors_[runs_[i].mirror];
    const std::uint32_t count = end_of(i) - runs_[i].begin;
    if (!is_grouped) std::copy_n(&rays_[runs_[i].begin], count, mirror.rays + mirror.count);
    mirror.count += count;
  }
}

// Returns the index of a mirror. A mirror that is not in the list is added.
std::uint32_t MirroredRays::index_of(std::uint32_t fixture, std::int32_t face) {
  std::size_t i = mirrors_.size();
  while (i > 0 && (mirrors_[i - 1].fixture != fixture || mirrors_[i - 1].face != face)) --i;
  if (i > 0) return static_cast<std::uint32_t>(i - 1);
  mirrors_.push_back({fixture, face, 0, nullptr});
  return static_cast<std::uint32_t>(mirrors_.size() - 1);
}

MirrorPlane plane_of(const b2Fixture& mirror, std::int32_t face) {
  const b2Transform& body = mirror.GetBody()->GetTransform();
  if (mirror.GetType() == b2Shape::e_edge) {
    const auto* edge = static_cast<const b2EdgeShape*>(mirror.GetShape());
    const b2Vec2 along = edge->m_vertex2 - edge->m_vertex1;
    b2Vec2 normal(along.y, -along.x);
    normal.Normalize();
    return {b2Mul(body, edge->m_vertex1), b2Mul(body.q, normal)};
  }
  const auto* polygon = static_cast<const b2PolygonShape*>(mirror.GetShape());
  return {b2Mul(body, polygon->m_vertices[face]), b2Mul(body.q, polygon->m_normals[face])};
}

MirrorPlane tangent_of(const b2Fixture& circle, const b2Vec2& point) {
  const auto* shape = static_cast<const b2CircleShape*>(circle.GetShape());
  b2Vec2 normal = point - b2Mul(circle.GetBody()->GetTransform(), shape->m_p);
  normal.Normalize();
  return {point, normal};
}

b2Transform image_of(const b2Transform& pose, const MirrorPlane& plane) {
  const b2Vec2& normal = plane.normal;
  b2Transform image;
  image.p = pose.p - 2.0F * b2Dot(pose.p - plane.point, normal) * normal;
  // The direction of the mirror is (-n.y, n.x).
  const float c = normal.y * normal.y - normal.x * normal.x;
  const float s = -2.0F * normal.x * normal.y;
  image.q.c = c * pose.q.c + s * pose.q.s;
  image.q.s = s * pose.q.c - c * pose.q.s;
  return image;
}

HalfPlane front_of(const MirrorPlane& plane, const b2Vec2& sensor, const b2Vec2& origin) {
  const bool is_inside = b2Dot(sensor - plane.point, plane.normal) >= 0.0F;
  const b2Vec2 normal = is_inside ? plane.normal : -plane.normal;
  const float offset = b2Dot(plane.point - origin, normal);
  // The offset is reduced by more than the rounding of coordinates.
  constexpr float kTolerance = 1e-3F;
  return {normal, offset - kTolerance * (1.0F + b2Abs(offset))};
}

}  // namespace flatland
