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
#include "rays/trace.h"

namespace flatland {

// The memory of scans, for any number of them one after the other.
struct ScanMemory {
  ScanBuffer buffer;
  AlignedFloats ranges;
  std::vector<float> limits;
  std::unique_ptr<bool[]> reflects, is_hit;
  std::size_t flags = 0;  // size of the arrays above
  TraceMemory trace;
};

// What the beams of a scan hit: the bodies with the categories of their fixtures.
struct HitTable {
  struct Entry {
    Id body;
    std::uint16_t category_bits;
  };

  // For each beam, 0 for none, else 1 + the index of an entry.
  std::uint32_t* labels;
  std::vector<Entry> entries;
};

// Where the readings of a scan are written. `intensities` and `hits` are null if they are not
// needed.
struct Readings {
  float* ranges;
  float* intensities;
  HitTable* hits = nullptr;
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
    bool uses_materials;  // otherwise all fixtures stop the beams
    bool is_cone;         // whether there is only one reading, that of the nearest hit
  };

  // The fan has the end points of the beams in the frame of the sensor. Throws
  // std::invalid_argument if the noise model is not defined for all ranges up to `length`.
  RangeFinder(std::shared_ptr<const BeamFan> fan, const Parameters& parameters);

  std::size_t beams() const { return fan_->size(); }
  // Number of ranges of a scan.
  std::size_t readings() const { return parameters_.is_cone ? 1 : beams(); }
  bool has_intensities(const RayScene& scene) const {
    return !parameters_.is_cone && (parameters_.reflect_mask != 0 || sees_materials(scene));
  }

  // Pose of the sensor in the world frame from that of its body.
  std::array<double, 3> pose_of(const std::array<double, 3>& body) const;

  // Performs a scan from a pose of the sensor. The intensity is 255 where the reading is that of a
  // reflecting fixture at the distance of the nearest hit, else 0. In a world with materials, other
  // hits have the intensity of a surface that scatters light (Lambert): 255 times the reflectance
  // times the cosine of the angle of incidence, divided by the square of the range [m] if it is
  // greater than 1.
  void scan(const SceneView& scene, const b2Transform& pose, const NoiseKey& key,
            const Readings& out, ScanMemory& memory) const;

 private:
  bool sees_materials(const RayScene& scene) const {
    return parameters_.uses_materials && !scene.materials().is_empty();
  }
  void write_ranges(const float* fractions, float* ranges) const;
  void scan_plain(const SceneView& scene, const b2Transform& pose, const Readings& out,
                  ScanMemory& memory) const;
  void scan_traced(const SceneView& scene, const b2Transform& pose, const NoiseKey& key,
                   const Readings& out, ScanMemory& memory) const;
  // Replaces the brightnesses by intensities.
  void write_intensities(TraceMemory& trace, float* intensities) const;
  void write_labels(const RayScene& scene, const ScanBuffer& ends, HitTable& hits) const;

  std::shared_ptr<const BeamFan> fan_;
  Parameters parameters_;
};

}  // namespace flatland
