#include "rays/scene_view.h"

#include <box2d/b2_body.h>

#include <algorithm>

#include "rays/raycast.h"

namespace flatland {
namespace {

// Least numbers of solids and of scans for which a tree pays off.
constexpr std::size_t kManySolids = 64;
constexpr std::size_t kManyScans = 4;

}  // namespace

SceneView::SceneView(RayScene& scene, std::size_t scans)
    : scene_(scene),
      edges_(scene.edge_groups()),
      solids_(scene.solids(), scans >= kManyScans && scene.solids().size() >= kManySolids) {}

void SceneView::draw(DepthScan& scan, RayMasks masks) const {
  for (const EdgeGroup& edges : edges_) {
    scan.draw(*edges.tree, edges.bodies.front()->GetTransform(), masks);
  }
  scan.draw(solids_, masks);
}

void find_reflections(DepthScan& scan, const SceneView& scene, const BeamFan& fan, RayMasks masks,
                      std::vector<float>& limits, bool* reflects) {
  float* fractions = scan.fractions();
  limits.resize(fan.count());
  for (std::size_t i = 0; i < fan.count(); ++i) {
    const bool is_hit = fractions[i] <= 1.0F;
    const float limit = fractions[i] + kFractionTolerance + kDistanceTolerance / fan.length()[i];
    // Near the end of a ray, the limit must not exceed the fraction of a miss.
    fractions[i] = limits[i] = is_hit ? std::min(limit, kMissFraction) : -1.0F;
  }
  scene.draw(scan, masks);
  for (std::size_t i = 0; i < fan.count(); ++i) {
    reflects[fan.order()[i]] = fractions[i] < limits[i];
  }
}

}  // namespace flatland
