#include "rays/reflection.h"

#include <box2d/b2_fixture.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace flatland {
namespace {

constexpr std::uint32_t kBundle = RayBundle::kMaxInAnyOrder;
// If a mirror reflects at most one in this number of the rays in its direction, casting only these
// rays in bundles costs less than a scan of all of the rays.
constexpr std::uint32_t kSparse = 4;
// The distance by which a hit may seem to be behind the mirror because of rounding, as a fraction
// of the length of a ray, and in metres.
constexpr float kMirrorTolerance = 1e-5F;

// The least fraction of a hit after the reflection.
float nearest_after(float fraction, float length) {
  return std::max(fraction - kMirrorTolerance * (1.0F + 1.0F / length), 0.0F);
}

// A range of rays of a fan. The index `count` + i refers to ray i of a fan with `count` rays.
struct Arc {
  std::uint32_t begin, end;
};

// Returns a range that contains the places of the rays of a mirror in the mirrored fan.
Arc arc_of(const MirroredFan& fan, const Mirror& mirror) {
  const auto count = static_cast<std::uint32_t>(fan.place.size());
  const std::uint32_t front = fan.place[mirror.rays[0]];
  const std::uint32_t back = fan.place[mirror.rays[mirror.count - 1]];
  // In the usual case, the largest gap is the part of the fan outside of the rays.
  if (fan.is_reversed && front < back && back - front < count / 2) return {front, back + 1};
  // The range begins after the largest gap. The places increase, except for rays with the same
  // direction.
  std::uint32_t begin = front;
  std::uint32_t gap = begin + count - back;
  for (std::uint32_t k = 1; k < mirror.count; ++k) {
    const std::uint32_t before = fan.place[mirror.rays[k - 1]];
    const std::uint32_t place = fan.place[mirror.rays[k]];
    if (place > before + gap) {
      begin = place;
      gap = place - before;
    }
  }
  std::uint32_t least = count, last = 0;
  for (std::uint32_t k = 0; k < mirror.count; ++k) {
    const std::uint32_t place = fan.place[mirror.rays[k]];
    const std::uint32_t turned = place < begin ? place + count : place;
    least = std::min(least, turned);
    last = std::max(last, turned);
  }
  return {least, last + 1};
}

class Reflector {
 public:
  Reflector(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
            const TraceRules& rules, TraceMemory& memory)
      : scene_(scene), fan_(fan), pose_(pose), rules_(rules), memory_(memory) {
    memory.bundle_x.resize(kBundle);
    memory.bundle_y.resize(kBundle);
    memory.places.resize(fan.count());
    memory.image_words.resize(AlignedFloats::rounded(fan.count()));
  }

  void run() {
    for (const Mirror& mirror : memory_.mirrored.find(scene_.scene(), fan_, pose_, memory_.ends)) {
      const b2Fixture& fixture = *scene_.scene().fixture_at(mirror.fixture);
      if (fixture.GetType() == b2Shape::e_circle) {
        for (std::uint32_t k = 0; k < mirror.count; ++k) cast_from(fixture, mirror.rays[k]);
      } else {
        scan_image(mirror, plane_of(fixture, mirror.face));
      }
    }
  }

 private:
  HitRules rules_after(std::uint32_t mirror) const {
    return {&scene_.scene().materials(), memory_.image_words.data(), HitRules::kReflected, mirror,
            rules_.preferred};
  }

  void draw(DepthScan& hits) const { scene_.draw(hits, {rules_.mask, kAnyCategory}); }

  // Scans from the image of the sensor in a flat mirror. A straight ray from the image passes
  // through the mirror, and coincides with the reflected ray in front of the mirror.
  void scan_image(const Mirror& mirror, const MirrorPlane& plane) {
    const b2Transform image = image_of(pose_, plane);
    const HalfPlane front = front_of(plane, pose_.p, image.p);
    if (mirror.count > kBundle) {
      const Arc arc = arc_of(fan_.mirrored(), mirror);
      if (mirror.count * kSparse > arc.end - arc.begin) {
        scan_arc(mirror, arc, image, front);
        return;
      }
    }
    for (std::uint32_t first = 0; first < mirror.count; first += kBundle) {
      const std::uint32_t count = std::min(mirror.count - first, kBundle);
      cast_bundle({mirror.fixture, mirror.face, count, mirror.rays + first}, image, front);
    }
  }

  void scan_arc(const Mirror& mirror, const Arc& arc, const b2Transform& image,
                const HalfPlane& front) {
    const MirroredFan& mirrored = fan_.mirrored();
    const HitRules rules = rules_after(mirror.fixture);
    DepthScan hits(RayBundle::of(mirrored.fan), arc.begin, arc.end, front, image, memory_.image,
                   rules);
    const std::uint32_t* place = mirrored.place.data();
    for (std::uint32_t k = 0; k < mirror.count; ++k) memory_.places[k] = place[mirror.rays[k]];
    scan(hits, mirror);
  }

  void cast_bundle(const Mirror& mirror, const b2Transform& image, const HalfPlane& front) {
    const HitRules rules = rules_after(mirror.fixture);
    const RayBundle bundle{memory_.bundle_x.data(),
                           memory_.bundle_y.data(),
                           mirror.count,
                           fan_.min_length(),
                           fan_.max_length(),
                           nullptr,
                           0};
    DepthScan hits(bundle, 0, mirror.count, front, image, memory_.image, rules);
    for (std::uint32_t k = 0; k < mirror.count; ++k) {
      memory_.bundle_x[k] = fan_.x()[mirror.rays[k]];
      memory_.bundle_y[k] = -fan_.y()[mirror.rays[k]];
      memory_.places[k] = k;
    }
    scan(hits, mirror);
  }

  // Performs the scan from an image, for the rays of the mirror, whose indices are in
  // `memory.places`.
  void scan(DepthScan& hits, const Mirror& mirror) {
    const std::uint32_t* places = memory_.places.data();
    const std::uint32_t* words = memory_.words.data();
    const float* length = fan_.length();
    float* fraction = memory_.image.fraction.data();
    float* nearest = memory_.image.nearest.data();
    std::uint32_t* image_words = memory_.image_words.data();
    ScanBuffer& ends = memory_.ends;
    float* end = ends.fraction.data();
    for (std::uint32_t k = 0; k < mirror.count; ++k) {
      const std::uint32_t ray = mirror.rays[k], place = places[k];
      image_words[place] = words[ray];
      fraction[place] = kMissFraction;
      nearest[place] = nearest_after(end[ray], length[ray]);
    }
    draw(hits);
    const float* fixture = memory_.image.fixture.data();
    const float* brightness = memory_.image.brightness.data();
    float* end_fixture = ends.fixture.data();
    float* end_brightness = ends.brightness.data();
    for (std::uint32_t k = 0; k < mirror.count; ++k) {
      const std::uint32_t ray = mirror.rays[k], place = places[k];
      end[ray] = std::max(fraction[place], end[ray]);
      std::memcpy(end_fixture + ray, fixture + place, sizeof(float));
      end_brightness[ray] = brightness[place];
    }
    for (std::uint32_t k = 0; rules_.preferred != 0 && k < mirror.count; ++k) mark(mirror.rays[k]);
  }

  // Casts one ray from the point where a circle reflects it.
  void cast_from(const b2Fixture& circle, std::uint32_t ray) {
    const std::uint32_t slot = memory_.ends.slots()[ray];
    const float fraction = memory_.ends.fraction[ray];
    const float rest = 1.0F - fraction;
    const b2Vec2 direct = b2Mul(pose_.q, b2Vec2(fan_.x()[ray], fan_.y()[ray]));
    b2Transform pose;
    pose.Set(pose_.p + fraction * direct, 0.0F);
    const MirrorPlane plane = tangent_of(circle, pose.p);
    const b2Vec2 end = rest * (direct - 2.0F * b2Dot(direct, plane.normal) * plane.normal);
    const float length = end.Length();
    if (!(length > 0.0F)) {
      set_end(ray, kMissFraction, slot, 0.0F);
      return;
    }
    memory_.bundle_x[0] = end.x;
    memory_.bundle_y[0] = end.y;
    memory_.image_words[0] = memory_.words[ray];
    const HitRules rules = rules_after(slot);
    const RayBundle bundle{
        memory_.bundle_x.data(), memory_.bundle_y.data(), 1, length, length, nullptr, 0};
    const HalfPlane front = front_of(plane, pose_.p, pose.p);
    DepthScan hits(bundle, 0, 1, front, pose, memory_.image, rules);
    memory_.image.fraction[0] = kMissFraction;
    memory_.image.nearest[0] = 0.0F;
    draw(hits);
    const float after = memory_.image.fraction[0];
    set_end(ray, after <= 1.0F ? fraction + rest * after : kMissFraction, memory_.image.slots()[0],
            memory_.image.brightness[0] / rest);
  }

  // Replaces the end of a ray by the end of the reflected ray.
  void set_end(std::uint32_t ray, float fraction, std::uint32_t slot, float brightness) {
    memory_.ends.fraction[ray] = fraction;
    memory_.ends.slots()[ray] = slot;
    memory_.ends.brightness[ray] = brightness;
    if (rules_.preferred != 0) mark(ray);
  }

  // Updates whether a fixture with a preferred category is at the end of a ray.
  void mark(std::uint32_t ray) {
    bool is_preferred = false;
    if (memory_.ends.fraction[ray] <= 1.0F) {
      const b2Fixture& fixture = *scene_.scene().fixture_at(memory_.ends.slots()[ray]);
      is_preferred = (fixture.GetFilterData().categoryBits & rules_.preferred) != 0;
    }
    memory_.is_preferred[ray] = static_cast<char>(is_preferred);
  }

  const SceneView& scene_;
  const BeamFan& fan_;
  const b2Transform& pose_;
  const TraceRules& rules_;
  TraceMemory& memory_;
};

}  // namespace

void reflect(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
             const TraceRules& rules, TraceMemory& memory) {
  Reflector(scene, fan, pose, rules, memory).run();
}

}  // namespace flatland
