#include "rays/trace.h"

#include <box2d/b2_body.h>
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_polygon_shape.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <utility>

#include "rays/range_noise.h"
#include "rays/raycast.h"
#include "world/contacts.h"

namespace flatland {
namespace {

// A mirror that reflects fewer rays has them cast one by one, at about 1 us each. The scan of an
// image costs as much as some of them.
constexpr std::uint32_t kFewRays = 2;
// If a mirror reflects at most one of this number of rays in its direction, a fan of these rays
// alone pays off.
constexpr std::uint32_t kSparse = 4;
// By how much a hit may seem to be behind the mirror because of rounding, as a part of the length
// of a ray, and in metres.
constexpr float kMirrorTolerance = 1e-5F;

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
  ReflectedHit(const HitRules& rules, std::uint16_t mask, std::uint32_t word)
      : rules_(rules), mask_(mask), word_(word) {}

  float ReportFixture(b2Fixture* fixture, const b2Vec2&, const b2Vec2&, float fraction) override {
    constexpr float kIgnore = -1.0F;
    const std::uint32_t slot = RayScene::Fixtures::slot_of(id_of(fixture));
    const bool stops = (fixture->GetFilterData().categoryBits & mask_) != 0;
    if (fixture->IsSensor() || !stops || slot == rules_.excluded || std::isnan(fraction)) {
      return kIgnore;
    }
    const std::uint32_t limit = rules_.materials->pass_limit(slot);
    if (limit == Materials::kInvisible) return kIgnore;
    if (fate_word(word_, rules_.leg ^ slot) < limit) return kIgnore;
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
  std::uint32_t word_;
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
    const std::size_t count = fan_.count();
    memory_.words.resize((count + kWordsPerGroup - 1) / kWordsPerGroup * kWordsPerGroup);
    if (materials_->needs_words()) draw_words(rules_.key, count, memory_.words.data());
    const HitRules hit_rules{materials_, memory_.words.data(), HitRules::kDirect,
                             HitRules::kNoFixture, rules_.preferred};
    DepthScan hits(fan_, pose_, buffer, hit_rules);
    scene_.draw(hits, {rules_.mask, kAnyCategory});
    take_ends(hits);
    if (rules_.preferred != 0) find_preferred(buffer);
    if (materials_->has_mirrors()) reflect();
  }

 private:
  bool is_hit(std::size_t ray) const { return ends_.fraction[ray] <= 1.0F; }

  b2Vec2 along(std::size_t ray) const {
    return b2Mul(pose_.q, b2Vec2(fan_.x()[ray], fan_.y()[ray]));
  }

  const b2Fixture& fixture_at(std::uint32_t slot) const { return *scene_.scene().fixture_at(slot); }

  // Sets the ends of all rays of the direct scan.
  void take_ends(const DepthScan& hits) {
    const std::size_t count = fan_.count();
    ends_.fraction.assign(hits.fractions(), hits.fractions() + count);
    ends_.fixture.resize(count);
    hits.copy_fixtures(ends_.fixture.data());
    if (!rules_.needs_brightness) return;
    ends_.brightness.resize(count);
    // Consecutive rays often hit the same fixture.
    for (std::size_t first = 0; first < count;) {
      const std::uint32_t slot = ends_.fixture[first];
      std::size_t last = first + 1;
      while (last < count && ends_.fixture[last] == slot) ++last;
      write_brightness(slot, first, last);
      first = last;
    }
  }

  // Writes the brightness of the rays from `first` to `last` - 1, which hit one fixture or none.
  void write_brightness(std::uint32_t slot, std::size_t first, std::size_t last) {
    float* brightness = ends_.brightness.data();
    if (slot == HitRules::kNoFixture) {
      std::fill(brightness + first, brightness + last, 0.0F);
      return;
    }
    const Shade shade = shade_of(pose_, slot);
    const float* fraction = ends_.fraction.data();
    if (shade.curved != nullptr) {
      for (std::size_t i = first; i < last; ++i) {
        brightness[i] = brightness_of(shade, fan_, pose_, i, fraction[i]);
      }
      return;
    }
    const float* x = fan_.x();
    const float* y = fan_.y();
    const float* length = fan_.length();
    for (std::size_t i = first; i < last; ++i) {
      const float height = std::abs(shade.normal.x * x[i] + shade.normal.y * y[i]);
      const float cosine = std::min(height / length[i], 1.0F);
      brightness[i] = fraction[i] <= 1.0F ? shade.reflectance * cosine : 0.0F;
    }
  }

  // How bright a fixture is.
  struct Shade {
    std::uint32_t slot = HitRules::kNoFixture;
    const b2Fixture* curved = nullptr;  // null if all points have the same normal
    b2Vec2 normal{0.0F, 0.0F};          // in the frame of the rays
    float reflectance = 0.0F;
  };

  Shade shade_of(const b2Transform& pose, std::uint32_t slot) const {
    Shade shade;
    shade.slot = slot;
    shade.reflectance = reflectance_of(slot);
    const b2Fixture& fixture = fixture_at(slot);
    if (fixture.GetType() == b2Shape::e_edge) {
      shade.normal = b2MulT(pose.q, surface_at(fixture, pose.p).normal);
    } else {
      shade.curved = &fixture;
    }
    return shade;
  }

  // Returns the brightness of the hit of a fixture; 0 for a miss.
  static float brightness_of(const Shade& shade, const BeamFan& fan, const b2Transform& pose,
                             std::size_t ray, float fraction) {
    b2Vec2 normal = shade.normal;
    const b2Vec2 along(fan.x()[ray], fan.y()[ray]);
    if (shade.curved != nullptr) {
      const b2Vec2 point = b2Mul(pose, fraction * along);
      normal = b2MulT(pose.q, surface_at(*shade.curved, point).normal);
    }
    const float cosine = std::min(std::abs(b2Dot(normal, along)) / fan.length()[ray], 1.0F);
    return fraction <= 1.0F ? shade.reflectance * cosine : 0.0F;
  }

  float reflectance_of(std::uint32_t slot) const {
    return materials_->at(materials_->number_of(slot)).reflectance;
  }

  // Casts the rays again at the fixtures with preferred categories only, near the distances of the
  // hits; see `find_reflections` in scene_view.h.
  void find_preferred(ScanBuffer& buffer) {
    static const Materials kNoMaterials;
    const HitRules hit_rules{&kNoMaterials, memory_.words.data(), HitRules::kDirect,
                             HitRules::kNoFixture, 0};
    DepthScan hits(fan_, pose_, buffer, hit_rules);
    const auto tolerance = [this](std::size_t ray) {
      return kFractionTolerance + kDistanceTolerance / fan_.length()[ray];
    };
    const std::size_t count = fan_.count();
    float* nearest = hits.limit_nearest();
    std::vector<float> limits(count);
    for (std::size_t i = 0; i < count; ++i) {
      const float limit = std::min(ends_.fraction[i] + tolerance(i), kMissFraction);
      hits.fractions()[i] = limits[i] = is_hit(i) ? limit : -1.0F;
      nearest[i] = std::max(ends_.fraction[i] - tolerance(i), 0.0F);
    }
    scene_.draw(hits, {rules_.mask, rules_.preferred});
    ends_.is_preferred.assign(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      ends_.is_preferred[i] = static_cast<char>(hits.fractions()[i] < limits[i]);
    }
  }

  // Replaces the ends of the rays that mirrors reflect.
  void reflect() {
    find_mirrors();
    for (const TraceMemory::Mirror& mirror : memory_.mirrors) {
      const b2Fixture& fixture = fixture_at(mirror.fixture);
      const std::uint32_t* rays = memory_.sorted_rays.data() + (mirror.end - mirror.count);
      if (fixture.GetType() == b2Shape::e_circle || mirror.count < kFewRays) {
        for (std::uint32_t i = 0; i < mirror.count; ++i) cast_reflected(fixture, rays[i]);
      } else {
        scan_image(mirror, rays);
      }
    }
  }

  // Finds the rays that mirrors reflect, grouped by the plane of the mirror. Those of a mirror are
  // in reverse order, which is the order of their images.
  void find_mirrors() {
    std::vector<TraceMemory::Mirror>& mirrors = memory_.mirrors;
    mirrors.clear();
    memory_.rays.clear();
    memory_.mirror_of_ray.clear();
    std::unordered_map<std::uint64_t, std::uint32_t> known;
    std::uint64_t last_plane = ~std::uint64_t{0};
    std::uint32_t last = 0;
    std::uint32_t slot = HitRules::kNoFixture;
    std::uint64_t limit = 0;
    for (std::size_t i = fan_.count(); i-- > 0;) {
      if (ends_.fixture[i] != slot) {
        slot = ends_.fixture[i];
        limit = materials_->mirror_limit(slot);
      }
      if (limit == 0 || !is_hit(i)) continue;
      if (fate_word(memory_.words[i], HitRules::kDirect ^ slot) >= limit) continue;
      const std::int32_t face = face_at(slot, i);
      const std::uint64_t plane = std::uint64_t{slot} << 32U | static_cast<std::uint32_t>(face);
      if (plane != last_plane) {
        last_plane = plane;
        const auto next = static_cast<std::uint32_t>(mirrors.size());
        const auto [place, is_new] = known.try_emplace(plane, next);
        if (is_new) mirrors.push_back({slot, face, 0, 0});
        last = place->second;
      }
      ++mirrors[last].count;
      memory_.rays.push_back(static_cast<std::uint32_t>(i));
      memory_.mirror_of_ray.push_back(last);
    }
    std::uint32_t end = 0;
    for (TraceMemory::Mirror& mirror : mirrors) {
      mirror.end = end;
      end += mirror.count;
    }
    memory_.sorted_rays.resize(memory_.rays.size());
    for (std::size_t i = 0; i < memory_.rays.size(); ++i) {
      memory_.sorted_rays[mirrors[memory_.mirror_of_ray[i]].end++] = memory_.rays[i];
    }
  }

  // Returns the face of a polygon that a ray hits; 0 for other shapes.
  std::int32_t face_at(std::uint32_t slot, std::size_t ray) const {
    const b2Fixture& fixture = fixture_at(slot);
    if (fixture.GetType() != b2Shape::e_polygon) return 0;
    return surface_at(fixture, pose_.p + ends_.fraction[ray] * along(ray)).face;
  }

  // Casts one ray from the point where it is reflected.
  void cast_reflected(const b2Fixture& mirror, std::uint32_t ray) {
    const b2Vec2 direct = along(ray);
    const float fraction = ends_.fraction[ray];
    const b2Vec2 point = pose_.p + fraction * direct;
    const b2Vec2 normal = surface_at(mirror, point).normal;
    const b2Vec2 reflected = direct - 2.0F * b2Dot(direct, normal) * normal;
    const HitRules hit_rules{materials_, nullptr, HitRules::kReflected, ends_.fixture[ray],
                             rules_.preferred};
    ReflectedHit callback(hit_rules, rules_.mask, memory_.words[ray]);
    const b2Vec2 to = point + (1.0F - fraction) * reflected;
    if ((to - point).LengthSquared() > 0.0F) {
      mirror.GetBody()->GetWorld()->RayCast(&callback, point, to);
    }
    if (callback.hit == nullptr) {
      set_end(ray, kMissFraction, ends_.fixture[ray], 0.0F);
      return;
    }
    const b2Vec2 end = point + callback.nearest * (to - point);
    const float height = std::abs(b2Dot(surface_at(*callback.hit, end).normal, reflected));
    const float cosine = std::min(height / fan_.length()[ray], 1.0F);
    set_end(ray, fraction + (1.0F - fraction) * callback.nearest, callback.hit_slot,
            reflectance_of(callback.hit_slot) * cosine);
  }

  // Returns the first and the last place of the rays of a mirror in the mirrored fan.
  static std::pair<std::uint32_t, std::uint32_t> places_of(const MirroredFan& fan,
                                                           const TraceMemory::Mirror& mirror,
                                                           const std::uint32_t* rays) {
    std::uint32_t low = fan.place[rays[0]];
    std::uint32_t high = low;
    for (std::uint32_t k = 1; k < mirror.count; ++k) {
      low = std::min(low, fan.place[rays[k]]);
      high = std::max(high, fan.place[rays[k]]);
    }
    return {low, high};
  }

  // Makes the mirrored fan of the rays of one mirror.
  void make_fan(const TraceMemory::Mirror& mirror, const std::uint32_t* rays,
                std::optional<MirroredFan>& fan) {
    std::vector<float>& ends = memory_.image_ends;
    ends.clear();
    for (std::uint32_t k = 0; k < mirror.count; ++k) {
      ends.push_back(fan_.x()[rays[k]]);
      ends.push_back(-fan_.y()[rays[k]]);
    }
    fan.emplace(ends.data(), mirror.count);
  }

  // Scans from the image of the sensor in a flat mirror: what is in front of the mirror is where
  // the rays would hit it without the mirror.
  void scan_image(const TraceMemory::Mirror& mirror, const std::uint32_t* rays) {
    std::optional<MirroredFan> few;
    const MirroredFan& all = fan_.mirrored();
    const auto [low, high] = places_of(all, mirror, rays);
    if (mirror.count * kSparse <= high - low) make_fan(mirror, rays, few);
    const BeamFan& fan = few ? few->fan : all.fan;
    const auto place_of = [&](std::uint32_t k) { return few ? few->place[k] : all.place[rays[k]]; };
    const b2Fixture& fixture = fixture_at(mirror.fixture);
    const b2Vec2 point = pose_.p + ends_.fraction[rays[0]] * along(rays[0]);
    const b2Transform image =
        image_of(surface_at(fixture, point).normal, point_of(fixture, mirror.face));
    std::vector<std::uint32_t>& words = memory_.image_words;
    words.resize(AlignedFloats::rounded(fan.count()));
    const HitRules hit_rules{materials_, words.data(), HitRules::kReflected, mirror.fixture,
                             rules_.preferred};
    DepthScan hits(fan, image, memory_.image, hit_rules);
    float* fraction = hits.fractions();
    std::fill_n(fraction, fan.count(), -1.0F);
    float* nearest = hits.limit_nearest();
    float least_distance = b2_maxFloat;
    for (std::uint32_t k = 0; k < mirror.count; ++k) {
      const std::uint32_t i = place_of(k);
      words[i] = memory_.words[rays[k]];
      fraction[i] = kMissFraction;
      const float length = fan.length()[i];
      const float tolerance = kMirrorTolerance * (1.0F + 1.0F / length);
      nearest[i] = std::max(ends_.fraction[rays[k]] - tolerance, 0.0F);
      least_distance = std::min(least_distance, nearest[i] * length);
    }
    if (!few) hits.restrict_to(low, high + 1);
    // Less than the distance by more than the rounding of coordinates.
    hits.set_least_distance(std::max(0.999F * least_distance - 1e-3F, 0.0F));
    scene_.draw(hits, {rules_.mask, kAnyCategory});
    Shade shade;
    for (std::uint32_t k = 0; k < mirror.count; ++k) {
      const std::uint32_t i = place_of(k);
      const std::uint32_t slot = hits.fixture(i);
      float brightness = 0.0F;
      if (rules_.needs_brightness && fraction[i] <= 1.0F) {
        if (slot != shade.slot) shade = shade_of(image, slot);
        brightness = brightness_of(shade, fan, image, i, fraction[i]);
      }
      set_end(rays[k], std::max(fraction[i], ends_.fraction[rays[k]]), slot, brightness);
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

  // Replaces the end of a ray by that of its reflection.
  void set_end(std::size_t ray, float fraction, std::uint32_t slot, float brightness) {
    ends_.fraction[ray] = fraction;
    ends_.fixture[ray] = slot;
    if (rules_.needs_brightness) ends_.brightness[ray] = brightness;
    if (rules_.preferred == 0) return;
    const bool is_preferred =
        fraction <= 1.0F && (fixture_at(slot).GetFilterData().categoryBits & rules_.preferred) != 0;
    ends_.is_preferred[ray] = static_cast<char>(is_preferred);
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
