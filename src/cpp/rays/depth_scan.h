// A scan as a one-dimensional depth buffer, which contains the range of each ray of a fan.
//
// Edges and shapes are drawn into the rays that they cover, approximately from front to back. A box
// is culled if it is behind the hits of all rays that it covers. The intersection of a ray with a
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
#include <limits>
#include <vector>

#include "rays/aligned_floats.h"
#include "rays/beam_fan.h"
#include "rays/edge_tree.h"
#include "rays/materials.h"
#include "rays/solid_tree.h"

namespace flatland {

struct HitView;
struct ScanFrame;
struct ScanView;

// The least fraction that stands for a miss.
inline constexpr float kMissFraction = 1.0F + std::numeric_limits<float>::epsilon();

// A fixture stops a ray if it has a category in each of the two masks.
struct RayMasks {
  std::uint16_t stop;
  std::uint16_t select;

  bool pass(std::uint16_t category_bits) const {
    return (category_bits & stop) != 0 && (category_bits & select) != 0;
  }
};

// The memory of scans, which any number of scans may use one after the other. For each ray, d_x and
// d_y are the vector along the ray in some frame, and `fraction` is the fraction of the nearest
// hit. The other arrays are used only by scans that find fixtures: `nearest` is the least fraction
// of a hit, `fixture` has the bits of the slot of the fixture, and `brightness` is that of the hit.
struct ScanBuffer {
  AlignedFloats d_x, d_y, fraction, nearest, fixture, brightness;

  // The slots of the fixtures. The slot of a miss is unspecified.
  using Slot = std::uint32_t __attribute__((may_alias));
  Slot* slots() { return reinterpret_cast<Slot*>(fixture.data()); }
  const Slot* slots() const { return reinterpret_cast<const Slot*>(fixture.data()); }
};

// Rays from a common origin to points in the frame of the rays.
struct RayBundle {
  const float *x, *y;  // whole blocks
  std::size_t count;
  float min_length, max_length;  // bounds of the lengths of the rays
  // The table of BeamFan. Null for a few rays in any order, which are compared one by one with
  // boxes.
  static constexpr std::size_t kMaxInAnyOrder = AlignedFloats::kBlock;
  const std::int32_t* first_in_cell;
  int cell_bits;

  static RayBundle of(const BeamFan& fan) {
    return {fan.x(),          fan.y(),          fan.count(),
            fan.min_length(), fan.max_length(), fan.first_in_cell(),
            fan.cell_bits()};
  }
};

// The rules of scans that find fixtures. A ray passes a fixture that transmits beams if a random
// word is below the limit of the material. The random word is `mix_fixture` of the word of the ray,
// and of the slot of the fixture with the bits of the leg.
struct HitRules {
  static constexpr std::uint32_t kNoFixture = 0xFFFFFFFFU;
  // The legs of a path, before and after a reflection.
  static constexpr std::uint32_t kDirect = 0;
  static constexpr std::uint32_t kReflected = 0x80000000U;
  // The brightness of a hit of the first leg at which a mirror reflects the ray.
  static constexpr float kReflects = -1.0F;

  const Materials* materials;  // null if all fixtures are opaque
  const std::uint32_t* words;  // random words of the sorted rays, whole blocks; see `draw_words`
  std::uint32_t leg;
  std::uint32_t excluded;   // a fixture that is not hit, or kNoFixture
  std::uint16_t preferred;  // categories of the edge that is hit, of two coincident edges
};

// One side of a line.
struct HalfPlane {
  b2Vec2 normal;  // unit vector, to the inside
  float offset;   // position of the line along the normal, from the origin of a scan [m]
};

class DepthScan {
 public:
  // Creates a scan in which all rays are misses. The fan and the buffer must outlive the scan.
  DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer)
      : DepthScan(RayBundle::of(fan), pose, buffer, nullptr) {}
  // Creates a scan that also finds the fixtures, at about 1.2 times the cost. The rules must
  // outlive the scan.
  DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer, const HitRules& rules)
      : DepthScan(RayBundle::of(fan), pose, buffer, &rules) {}
  // Creates a scan of the rays from `first` to `last` - 1. Ray `count` + i is ray i of the bundle.
  // The caller marks the rays that are to be cast as misses, and sets their `nearest` fractions.
  // Fixtures outside of the half-plane may be skipped.
  DepthScan(const RayBundle& rays, std::size_t first, std::size_t last, const HalfPlane& inside,
            const b2Transform& pose, ScanBuffer& buffer, const HitRules& rules);

  // Draws the edges of a tree; `body` is the pose of the frame of the tree.
  void draw(const EdgeTree& tree, const b2Transform& body, RayMasks masks);
  // Draws circles and polygons.
  void draw(const SolidTree& solids, RayMasks masks);

  // The fraction of the nearest hit of each ray, in sorted order; greater than 1 for a miss. `draw`
  // ignores hits at or beyond these fractions. The caller may change the fractions between two
  // calls of `draw`.
  float* fractions() { return buffer_.fraction.data(); }
  const float* fractions() const { return buffer_.fraction.data(); }
  // Returns the fractions below which `draw` ignores hits, one for each ray and initially 0. Only
  // for scans that find fixtures.
  float* limit_nearest();

 private:
  DepthScan(const RayBundle& rays, const b2Transform& pose, ScanBuffer& buffer,
            const HitRules* rules);

  bool is_empty() const { return first_ == last_; }
  void set_frame(const ScanView& view, const ScanFrame& frame, const b2Transform& body);
  ScanView view() const;
  HitView hits(const b2Rot& body) const;
  // Returns the relation of the rays to the world frame.
  ScanFrame world_frame(const ScanView& view, RayMasks masks);

  RayBundle rays_;
  b2Transform pose_;
  ScanBuffer& buffer_;
  const HitRules* rules_;
  bool has_nearest_ = false;
  HalfPlane inside_{{0.0F, 0.0F}, 0.0F};
  b2Transform frame_;  // frame of the vectors d_x, d_y in the buffer: that of the last tree
  bool has_frame_ = false;
  std::int32_t first_ = 0, last_;
};

}  // namespace flatland
