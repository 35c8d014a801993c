// The mirrors that rays hit, and the images of a sensor in them.
#pragma once

#include <box2d/b2_math.h>

#include <cstdint>
#include <vector>

#include "rays/beam_fan.h"
#include "rays/depth_scan.h"
#include "rays/ray_scene.h"

namespace flatland {

// A mirror, or a face of a polygon, with the rays that it reflects.
struct Mirror {
  std::uint32_t fixture;
  std::int32_t face;    // of a polygon; 0 for other shapes
  std::uint32_t count;  // of its rays
  std::uint32_t* rays;
};

// The rays of a scan that mirrors reflect, grouped by mirror.
class MirroredRays {
 public:
  // Finds the rays whose hits have the brightness HitRules::kReflects. The rays of a mirror are in
  // reverse order, which is the order of their images. The mirrors are valid until the next call.
  const std::vector<Mirror>& find(const RayScene& scene, const BeamFan& fan,
                                  const b2Transform& pose, const ScanBuffer& hits);

 private:
  // Successive rays of a mirror, up to the beginning of the next run.
  struct Run {
    std::uint32_t mirror;  // its index
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
  std::vector<std::uint32_t> rays_;  // in the order of the scan
  std::uint32_t count_ = 0;
  std::vector<std::uint32_t> grouped_;  // by mirror, unless they are grouped already
};

// A line in the world frame.
struct MirrorPlane {
  b2Vec2 point;
  b2Vec2 normal;  // unit vector to any side
};

// The line of an edge or of a face of a polygon.
MirrorPlane plane_of(const b2Fixture& mirror, std::int32_t face);
// The tangent of a circle at a point of its outline.
MirrorPlane tangent_of(const b2Fixture& circle, const b2Vec2& point);

// The pose of a sensor in a mirror. Directions at the angle psi become 2 alpha - psi, with the
// angle alpha of the mirror; the fan is mirrored, too.
b2Transform image_of(const b2Transform& pose, const MirrorPlane& plane);

// The half-plane in front of a mirror, relative to a point, within rounding. A sensor, or another
// point, is in front of it.
HalfPlane front_of(const MirrorPlane& plane, const b2Vec2& sensor, const b2Vec2& origin);

}  // namespace flatland
