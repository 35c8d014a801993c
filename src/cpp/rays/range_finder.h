// Range finders: a fan of beams, what stops them, and how hits become readings.
#pragma once

#include <box2d/b2_math.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "rays/beam_fan.h"
#include "rays/depth_scan.h"
#include "rays/range_noise.h"
#include "rays/scene_view.h"

namespace flatland {

// The memory of scans, for any number of them one after the other.
struct ScanMemory {
  ScanBuffer buffer;
  AlignedFloats ranges;
  std::vector<float> limits;
  std::unique_ptr<bool[]> reflects, is_hit;
  std::size_t flags = 0;  // size of the arrays above
};

// Where the readings of a scan are written. `intensities` is null if they are not needed.
struct Readings {
  float* ranges;
  float* intensities;
};

// Immutable, without references to a world.
class RangeFinder {
 public:
  struct Parameters {
    std::array<double, 3> origin;  // pose (x, y, theta) in the frame of the body [m, rad]
    float length;                  // of the beams; the factor of fractions [m]
    std::uint16_t mask;            // categories that stop a beam
    std::uint16_t reflect_mask;    // categories that reflect; 0 for no intensities
    RangeLimits limits;
    std::optional<RangeNoise> noise;
  };

  // The fan has the end points of the beams in the frame of the sensor. Throws
  // std::invalid_argument if the noise model is not defined for all ranges up to `length`.
  RangeFinder(std::shared_ptr<const BeamFan> fan, const Parameters& parameters);

  std::size_t beams() const { return fan_->size(); }
  bool has_intensities() const { return parameters_.reflect_mask != 0; }

  // Pose of the sensor in the world frame from that of its body.
  std::array<double, 3> pose_of(const std::array<double, 3>& body) const;

  // Performs a scan from a pose of the sensor. The intensity is 255 where the reading is that of a
  // reflecting fixture at the distance of the nearest hit, else 0.
  void scan(const SceneView& scene, const b2Transform& pose, const NoiseKey& key,
            const Readings& out, ScanMemory& memory) const;

 private:
  void write_ranges(const float* fractions, float* ranges) const;

  std::shared_ptr<const BeamFan> fan_;
  Parameters parameters_;
};

}  // namespace flatland
