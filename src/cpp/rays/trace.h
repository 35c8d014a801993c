// The paths of rays in a world with materials: through glass, with at most one reflection by a
// mirror.
#pragma once

#include <box2d/b2_math.h>

#include <cstdint>
#include <vector>

#include "rays/depth_scan.h"
#include "rays/mirrors.h"
#include "rays/range_noise.h"
#include "rays/scene_view.h"

namespace flatland {

// The parameters of a trace.
struct TraceRules {
  std::uint16_t mask;       // categories that stop a ray
  std::uint16_t preferred;  // categories of fixtures whose hits are marked; 0 for none
  NoiseKey key;
  bool uses_materials;  // otherwise all fixtures are opaque
};

// The memory of traces, which any number of traces may use one after the other.
struct TraceMemory {
  // The ends of the rays in sorted order. A fraction refers to the whole path. A brightness is the
  // product of the reflectance, the length of the ray and the cosine of the angle of incidence.
  ScanBuffer ends;
  // Whether a fixture with a preferred category is at the end of a ray; empty if no category is
  // preferred.
  std::vector<char> is_preferred;

  MirroredRays mirrored;
  ScanBuffer image;
  std::vector<std::uint32_t> words, image_words;  // random words of the rays
  AlignedFloats bundle_x, bundle_y;
  std::vector<std::uint32_t> places;  // indices of the rays of a mirror in the scan of the image
  std::vector<float> limits;
};

// Finds the ends of the rays of a scan. A ray that hits a fixture with a material passes with the
// probability `transmission`, and is reflected as by a mirror with the probability `specular`. Each
// beam draws anew in each update. A ray that was reflected once ends at the next mirror.
void trace(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
           const TraceRules& rules, TraceMemory& memory);

}  // namespace flatland
