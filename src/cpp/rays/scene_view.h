// What the rays of a scan can hit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rays/depth_scan.h"
#include "rays/ray_scene.h"
#include "rays/solid_tree.h"

namespace flatland {

inline constexpr std::uint16_t kAnyCategory = 0xFFFF;

// The fixtures of a world while it does not change. Several threads may use a view at a time.
class SceneView {
 public:
  // A view for this number of scans, which may be worth a tree of circles and polygons.
  explicit SceneView(RayScene& scene, std::size_t scans = 1);

  const RayScene& scene() const { return scene_; }

  void draw(DepthScan& scan, RayMasks masks) const;

 private:
  const RayScene& scene_;
  const std::vector<EdgeGroup>& edges_;
  SolidTree solids_;
};

// Marks the rays with a reflecting fixture at the distance of the nearest hit: casts the rays of a
// complete scan again at these fixtures only, up to the distances of the hits. `reflects` has an
// entry for each end point of the fan, initially false. Overwrites the fractions of the scan;
// `limits` is memory.
void find_reflections(DepthScan& scan, const SceneView& scene, const BeamFan& fan, RayMasks masks,
                      std::vector<float>& limits, bool* reflects);

}  // namespace flatland
