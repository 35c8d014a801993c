// A scan as a one-dimensional depth buffer that holds the range of each ray of a fan.
//
// Edges and shapes are drawn into the rays that they cover, approximately from front to back. Boxes
// that are hidden behind the hits of all of their rays are culled. The intersection of a ray with a
// shape is computed with the arithmetic of the RayCast functions of Box2D, in the same order and in
// single precision, so that the fractions equal those of b2World::RayCast. The only difference is
// the test for edges: a ray crosses an edge if the end points of the edge lie on different sides of
// the ray. Despite rounding, a ray therefore cannot pass between two edges with a common end point.
#pragma once

#include <box2d/b2_collision.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_math.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "rays/aligned_floats.h"
#include "rays/beam_fan.h"
#include "rays/edge_tree.h"
#include "rays/materials.h"
#include "rays/solid_tree.h"

namespace flatland {

// The smallest fraction of a miss.
inline constexpr float kMissFraction = 1.0F + std::numeric_limits<float>::epsilon();

// A fixture stops a ray if it has a category in each of the two masks.
struct RayMasks {
  std::uint16_t stop;
  std::uint16_t select;

  bool pass(std::uint16_t category_bits) const {
    return (category_bits & stop) != 0 && (category_bits & select) != 0;
  }
};

// The memory of scans, for any number of them one after the other: for each ray, the vector along
// it in some frame, and the fraction of the nearest hit. The others are only used to find fixtures:
// the least fraction of a hit, and the bits of the slot of the fixture that is hit.
struct ScanBuffer {
  AlignedFloats d_x, d_y, fraction, nearest, fixture;
};

// How fixtures are hit, for scans that find out which ones are. A ray passes a fixture that
// transmits if a random word is below its limit: `fate_word` of the word of the ray and of the slot
// of the fixture with the bits of the leg.
struct HitRules {
  static constexpr std::uint32_t kNoFixture = 0xFFFFFFFFU;
  // The legs of a path: before and after a reflection.
  static constexpr std::uint32_t kDirect = 0;
  static constexpr std::uint32_t kReflected = 0x80000000U;

  const Materials* materials;
  const std::uint32_t* words;  // for each ray in sorted order, whole blocks; see `draw_words`
  std::uint32_t leg;
  std::uint32_t excluded;   // a fixture that is not hit, or kNoFixture
  std::uint16_t preferred;  // of two coincident edges, the one with these categories is hit
};

class DepthScan {
 public:
  // The fan and the buffer must outlive the scan. Initially all rays are misses.
  DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer)
      : DepthScan(fan, pose, buffer, nullptr) {}
  // A scan that also finds the fixtures, at about 1.3 times the cost. The rules must outlive it.
  DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer, const HitRules& rules)
      : DepthScan(fan, pose, buffer, &rules) {}

  // Limits the scan to the rays from `first` to `last` - 1, to be called before the first drawing.
  // The fractions of all others must be -1.
  void restrict_to(std::size_t first, std::size_t last) {
    first_ = static_cast<std::int32_t>(first);
    last_ = static_cast<std::int32_t>(last);
  }

  // Draws the edges of a tree; `body` is the pose of the frame of the tree.
  void draw(const EdgeTree& tree, const b2Transform& body, RayMasks masks);
  // Draws circles and polygons.
  void draw(const std::vector<b2Fixture*>& solids, RayMasks masks);
  void draw(const SolidTree& solids, RayMasks masks);

  // Fraction of the nearest hit of each ray, in sorted order; greater than 1 for a miss. While
  // drawing, hits at or beyond these fractions are ignored; the caller may change them in between.
  float* fractions() { return buffer_.fraction.data(); }
  const float* fractions() const { return buffer_.fraction.data(); }
  // Ignores hits of each ray at lower fractions than these, which are initially 0; only for scans
  // that find fixtures.
  float* limit_nearest();
  // Allows to skip what is nearer than the least distance [m] of all these limits.
  void set_least_distance(float distance) { least_distance_ = distance; }
  // The slot of the fixture that a ray hits, and those of all rays; unspecified for a miss.
  std::uint32_t fixture(std::size_t ray) const {
    std::uint32_t slot;
    std::memcpy(&slot, buffer_.fixture.data() + ray, sizeof(slot));
    return slot;
  }
  void copy_fixtures(std::uint32_t* slots) const {
    std::memcpy(slots, buffer_.fixture.data(), fan_.count() * sizeof(*slots));
  }

 private:
  DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer, const HitRules* rules);

  const BeamFan& fan_;
  b2Transform pose_;
  ScanBuffer& buffer_;
  const HitRules* rules_;
  bool has_nearest_ = false;
  float least_distance_ = 0.0F;
  b2Transform frame_;  // of the vectors along the rays in the buffer, that of the tree drawn last
  bool has_frame_ = false;
  std::int32_t first_ = 0, last_;
};

}  // namespace flatland
