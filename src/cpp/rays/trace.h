// Paths of rays in a world with materials: through glass, and reflected once by a mirror.
#pragma once

#include <box2d/b2_math.h>

#include <cstdint>
#include <vector>

#include "rays/depth_scan.h"
#include "rays/range_noise.h"
#include "rays/scene_view.h"

namespace flatland {

// What is computed for the rays of a scan, besides the fractions.
struct TraceRules {
  std::uint16_t mask;       // categories that stop a ray
  std::uint16_t preferred;  // categories of fixtures that are marked; 0 for none
  NoiseKey key;
  bool uses_materials;  // otherwise all fixtures are opaque
  bool needs_brightness;
};

// The ends of the rays of a fan, in sorted order. May be used for several scans.
struct RayEnds {
  std::vector<float> fraction;         // of the length of the ray; greater than 1 for a miss
  std::vector<std::uint32_t> fixture;  // slot of the fixture; unspecified for a miss
  // Reflectance times the cosine of the angle of incidence; 0 for a miss.
  std::vector<float> brightness;
  // Whether a fixture with a preferred category is at the end of the ray; empty if there are none.
  std::vector<char> is_preferred;
};

// The memory of traces, for any number of them one after the other.
struct TraceMemory {
  // The rays that a mirror, or a face of a polygon, reflects.
  struct Mirror {
    std::uint32_t fixture;
    std::int32_t face;
    std::uint32_t count;
    std::uint32_t end;  // of its rays among those of all mirrors
  };

  ScanBuffer image;
  std::vector<Mirror> mirrors;
  std::vector<std::uint32_t> rays, sorted_rays, mirror_of_ray;  // that are reflected
  std::vector<std::uint32_t> words, image_words;                // of the rays
  std::vector<float> image_ends;
};

// Finds where the rays of a scan end. A ray that hits a fixture with a material passes it with the
// probability `transmission`, or else is reflected as by a mirror with the probability `specular`,
// both per beam and update. A ray that was reflected ends at the next mirror. The fraction of a
// reflected ray is that of the whole path.
void trace(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
           const TraceRules& rules, ScanBuffer& buffer, TraceMemory& memory, RayEnds& ends);

}  // namespace flatland
