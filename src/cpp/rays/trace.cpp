#include "rays/trace.h"

#include <box2d/b2_body.h>
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_polygon_shape.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "rays/raycast.h"
#include "rays/simd.h"
#include "world/contacts.h"

namespace flatland {
namespace {

namespace single {
using Lanes = simd::Lanes1;
#include "rays/random_kernel.h"
}  // namespace single

// A mirror that reflects fewer rays has them cast one by one, at about 1 us each. The scan of an
// image costs as much as some of them.
constexpr std::size_t kFewRays = 4;
// By how much a hit may seem to be behind the mirror because of rounding, as a part of the length
// of a ray, and in metres.
constexpr float kMirrorTolerance = 1e-5F;

std::uint32_t word_of(const NoiseKey& key, std::uint32_t ray, std::uint32_t leg,
                      std::uint32_t fixture) {
  return single::RandomWords(key, ray, leg | fixture).word[0];
}

// A point of the surface of a fixture.
struct Surface {
  b2Vec2 normal;  // unit vector to any side, world frame
  std::int32_t face;
};

// Returns the surface of a fixture next to a point in the world frame.
Surface surface_at(const b2Fixture& fixture, const b2Vec2& point) {
  const b2Transform& body = fixture.GetBody()->GetTransform();
  if (fixture.GetType() == b2Shape::e_circle) {
    const auto* circle = static_cast<const b2CircleShape*>(fixture.GetShape());
    b2Vec2 normal = point - b2Mul(body, circle->m_p);
    normal.Normalize();
    return {normal, 0};
  }
  if (fixture.GetType() == b2Shape::e_edge) {
    const auto* edge = static_cast<const b2EdgeShape*>(fixture.GetShape());
    const b2Vec2 along = edge->m_vertex2 - edge->m_vertex1;
    b2Vec2 normal(along.y, -along.x);
    normal.Normalize();
    return {b2Mul(body.q, normal), 0};
  }
  const auto* polygon = static_cast<const b2PolygonShape*>(fixture.GetShape());
  const b2Vec2 p_body = b2MulT(body, point);
  std::int32_t face = 0;
  float highest = -b2_maxFloat;
  for (std::int32_t i = 0; i < polygon->m_count; ++i) {
    const float height = b2Dot(polygon->m_normals[i], p_body - polygon->m_vertices[i]);
    if (height > highest) {
      highest = height;
      face = i;
    }
  }
  return {b2Mul(body.q, polygon->m_normals[face]), face};
}

// The nearest hit of a ray after its reflection, with b2World::RayCast.
class ReflectedHit final : public b2RayCastCallback {
 public:
  ReflectedHit(const HitRules& rules, std::uint16_t mask, std::uint32_t ray)
      : rules_(rules), mask_(mask), ray_(ray) {}

  float ReportFixture(b2Fixture* fixture, const b2Vec2&, const b2Vec2&, float fraction) override {
    constexpr float kIgnore = -1.0F;
    const std::uint32_t slot = RayScene::Fixtures::slot_of(id_of(fixture));
    const bool stops = (fixture->GetFilterData().categoryBits & mask_) != 0;
    if (fixture->IsSensor() || !stops || slot == rules_.excluded || std::isnan(fraction)) {
      return kIgnore;
    }
    const std::uint32_t limit = rules_.materials->pass_limit(slot);
    if (limit == Materials::kInvisible) return kIgnore;
    if (limit != Materials::kOpaque && word_of(rules_.key, ray_, rules_.leg, slot) < limit) {
      return kIgnore;
    }
    // Of several fixtures at the same distance, the one with the lowest slot.
    if (hit == nullptr || fraction < nearest || slot < hit_slot) {
      hit = fixture;
      hit_slot = slot;
      nearest = fraction;
    }
    return fraction;
  }

  const b2Fixture* hit = nullptr;
  std::uint32_t hit_slot = HitRules::kNoFixture;
  float nearest = 1.0F;

 private:
  const HitRules& rules_;
  std::uint16_t mask_;
  std::uint32_t ray_;
};

// One trace; see the function.
class Tracer {
 public:
  Tracer(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
         const TraceRules& rules, TraceMemory& memory, RayEnds& ends)
      : scene_(scene), fan_(fan), pose_(pose), rules_(rules), memory_(memory), ends_(ends) {}

  void run(ScanBuffer& buffer) {
    static const Materials kNoMaterials;
    materials_ = rules_.uses_materials ? &scene_.scene().materials() : &kNoMaterials;
    const HitRules hit_rules = rules_for(HitRules::kDirect, HitRules::kNoFixture);
    DepthScan hits(fan_, pose_, buffer, hit_rules);
    scene_.draw(hits, {rules_.mask, kAnyCategory});
    const std::size_t count = fan_.count();
    ends_.fraction.assign(hits.fractions(), hits.fractions() + count);
    ends_.fixture.resize(count);
    for (std::size_t i = 0; i < count; ++i) ends_.fixture[i] = hits.fixture(i);
    if (rules_.needs_cosines) {
      ends_.cosine.assign(count, 0.0F);
      CosineOf cosine_of(*this, fan_, pose_);
      for (std::size_t i = 0; i < count; ++i) {
        if (is_hit(i)) ends_.cosine[i] = cosine_of(i, ends_.fixture[i], ends_.fraction[i]);
      }
    }
    if (rules_.preferred != 0) find_preferred(buffer);
    if (materials_->has_mirrors()) reflect();
  }

 private:
  using Reflection = TraceMemory::Reflection;
  using Reflections = std::vector<Reflection>::const_iterator;

  // Cosines of the angles of incidence of rays of a fan. Consecutive rays often hit the same edge.
  class CosineOf {
   public:
    CosineOf(const Tracer& tracer, const BeamFan& fan, const b2Transform& pose)
        : tracer_(tracer), fan_(fan), pose_(pose) {}

    float operator()(std::size_t ray, std::uint32_t slot, float fraction) {
      const b2Vec2 end(fan_.x()[ray], fan_.y()[ray]);
      const b2Vec2 along = b2Mul(pose_.q, end);
      if (slot != slot_ || !is_flat_) {
        slot_ = slot;
        const b2Fixture* fixture = tracer_.scene_.scene().fixture_at(slot);
        is_flat_ = fixture->GetType() == b2Shape::e_edge;
        normal_ = surface_at(*fixture, pose_.p + fraction * along).normal;
      }
      return std::min(std::abs(b2Dot(normal_, along)) / fan_.length()[ray], 1.0F);
    }

   private:
    const Tracer& tracer_;
    const BeamFan& fan_;
    const b2Transform& pose_;
    std::uint32_t slot_ = HitRules::kNoFixture;
    bool is_flat_ = false;
    b2Vec2 normal_ = b2Vec2_zero;
  };

  HitRules rules_for(std::uint32_t leg, std::uint32_t excluded) const {
    return {materials_, rules_.key, leg, excluded, rules_.preferred};
  }

  bool is_hit(std::size_t ray) const { return ends_.fraction[ray] <= 1.0F; }

  b2Vec2 along(std::size_t ray) const {
    return b2Mul(pose_.q, b2Vec2(fan_.x()[ray], fan_.y()[ray]));
  }

  // Casts the rays again at the fixtures with preferred categories only, near the distances of the
  // hits; see `find_reflections` in scene_view.h.
  void find_preferred(ScanBuffer& buffer) {
    static const Materials kNoMaterials;
    const HitRules hit_rules{&kNoMaterials, rules_.key, HitRules::kDirect, HitRules::kNoFixture, 0};
    DepthScan hits(fan_, pose_, buffer, hit_rules);
    const auto tolerance = [this](std::size_t ray) {
      return kFractionTolerance + kDistanceTolerance / fan_.length()[ray];
    };
    const std::size_t count = fan_.count();
    std::vector<float> limits(count);
    for (std::size_t i = 0; i < count; ++i) {
      const float limit = std::min(ends_.fraction[i] + tolerance(i), kMissFraction);
      hits.fractions()[i] = limits[i] = is_hit(i) ? limit : -1.0F;
      hits.nearest()[i] = std::max(ends_.fraction[i] - tolerance(i), 0.0F);
    }
    scene_.draw(hits, {rules_.mask, rules_.preferred});
    ends_.is_preferred.assign(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      ends_.is_preferred[i] = static_cast<char>(hits.fractions()[i] < limits[i]);
    }
  }

  // Marks a reflected ray if the fixture at its end has a preferred category.
  void mark_reflected(std::size_t ray) {
    if (rules_.preferred == 0) return;
    const b2Fixture* fixture = scene_.scene().fixture_at(ends_.fixture[ray]);
    const bool is_preferred = (fixture->GetFilterData().categoryBits & rules_.preferred) != 0;
    ends_.is_preferred[ray] = static_cast<char>(is_preferred);
  }

  // Replaces the ends of the rays that mirrors reflect.
  void reflect() {
    find_reflections();
    const std::vector<Reflection>& all = memory_.reflections;
    for (auto first = all.begin(); first != all.end();) {
      const auto last = std::find_if(first, all.end(), [&](const Reflection& other) {
        return other.fixture != first->fixture || other.face != first->face;
      });
      const b2Fixture& mirror = *scene_.scene().fixture_at(first->fixture);
      const bool is_round = mirror.GetType() == b2Shape::e_circle;
      if (is_round || static_cast<std::size_t>(last - first) < kFewRays) {
        for (auto it = first; it != last; ++it) cast_reflected(mirror, it->ray);
      } else {
        scan_image(mirror, first, last);
      }
      first = last;
    }
  }

  // Finds the rays that mirrors reflect, sorted by the plane of the mirror.
  void find_reflections() {
    std::vector<Reflection>& all = memory_.reflections;
    all.clear();
    for (std::size_t i = 0; i < fan_.count(); ++i) {
      if (!is_hit(i)) continue;
      const std::uint32_t slot = ends_.fixture[i];
      const std::uint64_t limit = materials_->mirror_limit(slot);
      if (limit == 0) continue;
      const auto ray = static_cast<std::uint32_t>(i);
      constexpr std::uint64_t kAllWords = std::uint64_t{1} << 32U;
      if (limit < kAllWords && word_of(rules_.key, ray, HitRules::kDirect, slot) >= limit) continue;
      const b2Fixture& mirror = *scene_.scene().fixture_at(slot);
      const bool has_faces = mirror.GetType() == b2Shape::e_polygon;
      const b2Vec2 point = pose_.p + ends_.fraction[i] * along(i);
      all.push_back({slot, has_faces ? surface_at(mirror, point).face : 0, ray});
    }
    std::sort(all.begin(), all.end(), [](const Reflection& a, const Reflection& b) {
      return std::tie(a.fixture, a.face, a.ray) < std::tie(b.fixture, b.face, b.ray);
    });
  }

  // Casts one ray from the point where it is reflected.
  void cast_reflected(const b2Fixture& mirror, std::uint32_t ray) {
    const b2Vec2 direct = along(ray);
    const float fraction = ends_.fraction[ray];
    const b2Vec2 point = pose_.p + fraction * direct;
    const b2Vec2 normal = surface_at(mirror, point).normal;
    const b2Vec2 reflected = direct - 2.0F * b2Dot(direct, normal) * normal;
    const HitRules hit_rules = rules_for(HitRules::kReflected, ends_.fixture[ray]);
    ReflectedHit callback(hit_rules, rules_.mask, ray);
    const b2Vec2 to = point + (1.0F - fraction) * reflected;
    if ((to - point).LengthSquared() > 0.0F) {
      mirror.GetBody()->GetWorld()->RayCast(&callback, point, to);
    }
    if (callback.hit == nullptr) {
      end_without_hit(ray);
      return;
    }
    ends_.fraction[ray] = fraction + (1.0F - fraction) * callback.nearest;
    ends_.fixture[ray] = callback.hit_slot;
    mark_reflected(ray);
    if (!rules_.needs_cosines) return;
    const b2Vec2 end = point + callback.nearest * (to - point);
    const float height = b2Dot(surface_at(*callback.hit, end).normal, reflected);
    ends_.cosine[ray] = std::min(std::abs(height) / fan_.length()[ray], 1.0F);
  }

  // Scans from the image of the sensor in a flat mirror: what is in front of the mirror is where
  // the rays would hit it without the mirror.
  void scan_image(const b2Fixture& mirror, Reflections first, Reflections last) {
    const b2Vec2 point = pose_.p + ends_.fraction[first->ray] * along(first->ray);
    const b2Vec2 normal = surface_at(mirror, point).normal;
    const b2Vec2 on_mirror = point_of(mirror, first->face);
    const b2Transform image = image_of(normal, on_mirror);
    const BeamFan::Mirrored& mirrored = fan_.mirrored();
    const HitRules hit_rules = rules_for(HitRules::kReflected, first->fixture);
    DepthScan hits(mirrored.fan, image, memory_.image, hit_rules);
    // Only the rays that the mirror reflects are cast, from the mirror on.
    constexpr float kInactive = -1.0F;
    std::fill_n(hits.fractions(), fan_.count(), kInactive);
    for (auto it = first; it != last; ++it) {
      const std::uint32_t ray = mirrored.ray[it->ray];
      const float tolerance = kMirrorTolerance * (1.0F + 1.0F / fan_.length()[it->ray]);
      hits.nearest()[ray] = std::max(ends_.fraction[it->ray] - tolerance, 0.0F);
      hits.fractions()[ray] = kMissFraction;
    }
    scene_.draw(hits, {rules_.mask, kAnyCategory});
    CosineOf cosine_of(*this, mirrored.fan, image);
    for (auto it = first; it != last; ++it) {
      const std::uint32_t ray = mirrored.ray[it->ray];
      const float fraction = hits.fractions()[ray];
      if (!(fraction <= 1.0F)) {
        end_without_hit(it->ray);
        continue;
      }
      ends_.fraction[it->ray] = std::max(fraction, ends_.fraction[it->ray]);
      ends_.fixture[it->ray] = hits.fixture(ray);
      mark_reflected(it->ray);
      if (rules_.needs_cosines) {
        ends_.cosine[it->ray] = cosine_of(ray, ends_.fixture[it->ray], fraction);
      }
    }
  }

  // A point of the plane of a mirror, world frame.
  static b2Vec2 point_of(const b2Fixture& mirror, std::int32_t face) {
    const b2Transform& body = mirror.GetBody()->GetTransform();
    if (mirror.GetType() == b2Shape::e_edge) {
      return b2Mul(body, static_cast<const b2EdgeShape*>(mirror.GetShape())->m_vertex1);
    }
    return b2Mul(body, static_cast<const b2PolygonShape*>(mirror.GetShape())->m_vertices[face]);
  }

  // The pose of the sensor in a mirror. Directions at the angle psi become 2 alpha - psi, with the
  // angle alpha of the mirror; the fan is mirrored, too.
  b2Transform image_of(const b2Vec2& normal, const b2Vec2& on_mirror) const {
    b2Transform image;
    image.p = pose_.p - 2.0F * b2Dot(pose_.p - on_mirror, normal) * normal;
    // The direction of the mirror is (-n.y, n.x).
    const float c = normal.y * normal.y - normal.x * normal.x;
    const float s = -2.0F * normal.x * normal.y;
    image.q.c = c * pose_.q.c + s * pose_.q.s;
    image.q.s = s * pose_.q.c - c * pose_.q.s;
    return image;
  }

  void end_without_hit(std::size_t ray) {
    ends_.fraction[ray] = kMissFraction;
    if (rules_.needs_cosines) ends_.cosine[ray] = 0.0F;
  }

  const SceneView& scene_;
  const BeamFan& fan_;
  const b2Transform& pose_;
  const TraceRules& rules_;
  TraceMemory& memory_;
  RayEnds& ends_;
  const Materials* materials_ = nullptr;
};

}  // namespace

void trace(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
           const TraceRules& rules, ScanBuffer& buffer, TraceMemory& memory, RayEnds& ends) {
  Tracer(scene, fan, pose, rules, memory, ends).run(buffer);
}

}  // namespace flatland
