// The fixtures that the rays of a scan can hit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rays/depth_scan.h"
#include "rays/ray_scene.h"
#include "rays/solid_tree.h"

namespace flatland {

inline constexpr std::uint16_t kAnyCategory = 0xFFFF;

// The fixtures of a world that does not change during the life of the view. Several threads may use
// a view at a time.
class SceneView {
 public:
  // Creates a view for a number of scans. The view contains a tree of circles and polygons if the
  // tree saves time for so many scans.
  explicit SceneView(RayScene& scene, std::size_t scans = 1);

  const RayScene& scene() const { return scene_; }

  void draw(DepthScan& scan, RayMasks masks) const;

 private:
  const RayScene& scene_;
  const std::vector<EdgeGroup>& edges_;
  SolidTree solids_;
};

// Marks the rays with a reflecting fixture at the distance of the nearest hit. Casts the rays of a
// complete scan again at reflecting fixtures only, up to the distances of the hits. `reflects` has
// an entry for each end point of the fan, initially false. The fractions of the scan are
// overwritten; `limits` is memory for intermediate results.
void find_reflections(DepthScan& scan, const SceneView& scene, const BeamFan& fan, RayMasks masks,
                      std::vector<float>& limits, bool* reflects);

}  // namespace flatland
