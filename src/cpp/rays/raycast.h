// Closest hits of single rays and of whole scans.
#pragma once

#include <box2d/b2_math.h>

#include <cstddef>
#include <cstdint>
#include <optional>

#include "world/slot_map.h"

class b2World;

namespace flatland {

class RayScene;

// Where a ray meets the nearest fixture, in the world frame.
struct RayHit {
  float fraction;
  b2Vec2 point;
  b2Vec2 normal;
  Id fixture;
  std::uint16_t category_bits;
};

// Rays from the origin of a sensor to points in its frame.
struct ScanRequest {
  b2Transform pose;            // of the sensor, world frame
  const float* ends;           // x and y of each end
  std::size_t count;           // of rays
  std::uint16_t mask;          // categories that stop a ray
  std::uint16_t reflect_mask;  // categories that reflect; 0: not asked for
};

// `count` entries each. A fraction is NaN for a ray that hits nothing. `reflect` is not 0 where a
// reflecting fixture that `mask` lets through is at the distance of the nearest hit.
struct ScanResult {
  float* fractions;
  bool* reflect;
};

// How much farther than the nearest hit a fixture still is "at the same distance" [m], plus that
// part of the ray's length: what rounding does to two fixtures with one face in common.
inline constexpr float kSameDistance = 1e-4F;
inline constexpr float kSameFraction = 1e-5F;

// Nearest fixture that is no sensor and has a category in the mask. A ray of no length hits
// nothing.
std::optional<RayHit> ray_cast(const b2World& world, const b2Vec2& from, const b2Vec2& to,
                               std::uint16_t mask);

// The scan by one b2World::RayCast a ray: slow, the yardstick for `cast_rays`.
void cast_rays_reference(const b2World& world, const ScanRequest& request,
                         const ScanResult& result);

// The scan by the fast way.
void cast_rays(RayScene& scene, const ScanRequest& request, const ScanResult& result);

}  // namespace flatland
