// The nearest hits of single rays, and of scans without a range finder.
#pragma once

#include <box2d/b2_math.h>

#include <cstddef>
#include <cstdint>
#include <optional>

#include "world/slot_map.h"

namespace flatland {

class BeamFan;
class RayScene;
struct Engines;

// The nearest hit of a ray, in the world frame.
struct RayHit {
  float fraction;
  b2Vec2 point;
  b2Vec2 normal;
  Id fixture;
  std::uint16_t category_bits;
};

// Rays from the origin of a rangefinder to points in its frame.
struct ScanRequest {
  b2Transform pose;            // pose of the rangefinder in the world frame
  const float* ends;           // x and y of each end point
  std::size_t count;           // number of rays
  std::uint16_t mask;          // categories that stop a ray
  std::uint16_t reflect_mask;  // categories that reflect; 0 to skip reflections
};

// Arrays of `count` entries. A fraction is NaN for a miss. `reflect` is true where a fixture with
// categories in both masks is at the distance of the nearest hit.
struct ScanResult {
  float* fractions;
  bool* reflect;
};

// Two hits of a ray are at the same distance if they differ by at most kDistanceTolerance [m] plus
// kFractionTolerance of the length of the ray. This covers the rounding for two fixtures with a
// common face.
inline constexpr float kDistanceTolerance = 1e-4F;
inline constexpr float kFractionTolerance = 1e-5F;

// Returns the nearest hit of a fixture that has a category in the mask and is not a sensor. A ray
// of zero length is a miss.
std::optional<RayHit> ray_cast(const Engines& engines, const b2Vec2& from, const b2Vec2& to,
                               std::uint16_t mask);

// Performs a scan with b2World::RayCast. This is slow, and the reference in tests of `cast_rays`.
void cast_rays_reference(const Engines& engines, const ScanRequest& request,
                         const ScanResult& result);

// Performs a scan with a depth buffer; see depth_scan.h. The fan must have the end points of the
// request.
void cast_rays(RayScene& scene, const BeamFan& fan, const ScanRequest& request,
               const ScanResult& result);

}  // namespace flatland
