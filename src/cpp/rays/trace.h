// Paths of rays in a world with materials: through glass, and reflected once by a mirror.
#pragma once

#include <box2d/b2_math.h>

#include <cstdint>
#include <vector>

#include "rays/depth_scan.h"
#include "rays/mirrors.h"
#include "rays/range_noise.h"
#include "rays/scene_view.h"

namespace flatland {

// What is computed for the rays of a scan, besides the fractions.
struct TraceRules {
  std::uint16_t mask;       // categories that stop a ray
  std::uint16_t preferred;  // categories of fixtures that are marked; 0 for none
  NoiseKey key;
  bool uses_materials;  // otherwise all fixtures are opaque
};

// The memory of traces, for any number of them one after the other.
struct TraceMemory {
  // The ends of the rays in sorted order. The fractions are those of the whole path. A brightness
  // is the reflectance times the length of the ray times the cosine of the angle of incidence.
  ScanBuffer ends;
  // Whether a fixture with a preferred category is at the end of the ray; empty if there are none.
  std::vector<char> is_preferred;

  MirroredRays mirrored;
  ScanBuffer image;
  std::vector<std::uint32_t> words, image_words;  // of the rays
  AlignedFloats bundle_x, bundle_y;
  std::vector<std::uint32_t> places;  // of the rays of a mirror in the scan of its image
  std::vector<float> limits;
};

// Finds where the rays of a scan end. A ray that hits a fixture with a material passes it with the
// probability `transmission`, or else is reflected as by a mirror with the probability `specular`,
// both per beam and update. A ray that was reflected ends at the next mirror.
void trace(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
           const TraceRules& rules, TraceMemory& memory);

}  // namespace flatland
