// The mirrors that rays hit, and the images of a sensor in them.
#pragma once

#include <box2d/b2_math.h>

#include <cstdint>
#include <vector>

#include "rays/beam_fan.h"
#include "rays/depth_scan.h"
#include "rays/ray_scene.h"

namespace flatland {

// A mirror, or a face of a polygon, with the reflected rays.
struct Mirror {
  std::uint32_t fixture;
  std::int32_t face;    // index of the face of a polygon; 0 for other shapes
  std::uint32_t count;  // number of rays
  std::uint32_t* rays;
};

// The rays of a scan that mirrors reflect, grouped by mirror.
class MirroredRays {
 public:
  // Finds the rays whose hits have the brightness HitRules::kReflects, and returns their mirrors.
  // The rays of a mirror are in reverse order, which is the order of their images. The result is
  // valid until the next call.
  const std::vector<Mirror>& find(const RayScene& scene, const BeamFan& fan,
                                  const b2Transform& pose, const ScanBuffer& hits);

 private:
  // Consecutive rays of one mirror, up to the beginning of the next run.
  struct Run {
    std::uint32_t mirror;  // index of the mirror
    std::uint32_t begin;
  };

  void collect(const ScanBuffer& hits, std::size_t count);
  void group();
  std::uint32_t index_of(std::uint32_t fixture, std::int32_t face);
  std::uint32_t end_of(std::size_t run) const {
    return run + 1 < runs_.size() ? runs_[run + 1].begin : count_;
  }

  std::vector<Mirror> mirrors_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> rays_;  // reflected rays in the order of the scan
  std::uint32_t count_ = 0;
  std::vector<std::uint32_t> grouped_;  // rays by mirror, unless `rays_` is in this order
};

// A line in the world frame.
struct MirrorPlane {
  b2Vec2 point;
  b2Vec2 normal;  // unit vector to either side
};

// Returns the line of an edge or of a face of a polygon.
MirrorPlane plane_of(const b2Fixture& mirror, std::int32_t face);
// Returns the tangent of a circle at a point of the outline.
MirrorPlane tangent_of(const b2Fixture& circle, const b2Vec2& point);

// Returns the pose of the image of a sensor in a mirror. A direction at the angle psi becomes
// 2 alpha - psi, where alpha is the angle of the mirror. The image requires the mirrored fan.
b2Transform image_of(const b2Transform& pose, const MirrorPlane& plane);

// Returns the half-plane in front of a mirror, relative to `origin`. The side of `sensor` is in
// front. A margin covers rounding.
HalfPlane front_of(const MirrorPlane& plane, const b2Vec2& sensor, const b2Vec2& origin);

}  // namespace flatland
