// Range finders: a fan of beams, the fixtures that stop beams, and the conversion of hits to
// readings.
#pragma once

#include <box2d/b2_math.h>

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
#include "world/triple.h"

namespace flatland {

// The memory of scans, which any number of scans may use one after the other.
struct ScanMemory {
  ScanBuffer buffer;
  AlignedFloats ranges;
  std::vector<float> limits;
  std::unique_ptr<bool[]> reflects, is_hit;
  std::size_t flags = 0;  // size of `reflects` and of `is_hit`
  TraceMemory trace;
};

// The bodies that the beams of a scan hit, with the categories of the fixtures.
struct HitTable {
  struct Entry {
    Id body;
    std::uint16_t category_bits;
  };

  // One number for each beam: 0 for a miss, otherwise 1 + the index of an entry.
  std::uint32_t* labels;
  std::vector<Entry> entries;
};

// The arrays for the readings of a scan. `intensities` and `hits` may be null.
struct Readings {
  float* ranges;
  float* intensities;
  HitTable* hits = nullptr;
};

// A range finder is immutable and does not refer to a world.
class RangeFinder {
 public:
  struct Parameters {
    Triple origin;               // pose in the frame of the body
    float length;                // length of the beams; the factor of fractions [m]
    std::uint16_t mask;          // categories that stop a beam
    std::uint16_t reflect_mask;  // categories that reflect; 0 for no intensities
    RangeLimits limits;
    std::optional<RangeNoise> noise;
    bool uses_materials;  // whether beams pass glass; otherwise all fixtures stop the beams
    bool is_cone;         // whether the nearest hit is the only reading
  };

  // The end points of the fan are in the frame of the sensor. Throws std::invalid_argument if the
  // noise model is not defined for all ranges up to `length`.
  RangeFinder(std::shared_ptr<const BeamFan> fan, const Parameters& parameters);

  std::size_t beams() const { return fan_->size(); }
  // Returns the number of ranges of a scan.
  std::size_t readings() const { return parameters_.is_cone ? 1 : beams(); }
  bool has_intensities(const RayScene& scene) const {
    return !parameters_.is_cone && (parameters_.reflect_mask != 0 || sees_materials(scene));
  }

  // Returns the pose of the sensor from the pose of the body, both in the world frame.
  Triple pose_of(const Triple& body) const;

  // Performs a scan from a pose of the sensor. The intensity is 255 if a reflecting fixture is at
  // the distance of the nearest hit, otherwise 0. In a world with materials, other hits have the
  // intensity of a surface that scatters light (Lambert): 255 times the reflectance times the
  // cosine of the angle of incidence, divided by the square of the range [m] for ranges above 1 m.
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
