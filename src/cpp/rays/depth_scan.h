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
// the least fraction of a hit, the bits of the slot of the fixture that is hit, and its brightness.
struct ScanBuffer {
  AlignedFloats d_x, d_y, fraction, nearest, fixture, brightness;

  // The slots of the fixtures; unspecified for a miss.
  using Slot = std::uint32_t __attribute__((may_alias));
  Slot* slots() { return reinterpret_cast<Slot*>(fixture.data()); }
  const Slot* slots() const { return reinterpret_cast<const Slot*>(fixture.data()); }
};

// Rays from a common origin to points in a frame of their own.
struct RayBundle {
  const float *x, *y;  // whole blocks
  std::size_t count;
  float min_length, max_length;  // bounds of all lengths
  // See BeamFan. Null for a few rays in any order, which are compared one by one with boxes.
  static constexpr std::size_t kMaxInAnyOrder = AlignedFloats::kBlock;
  const std::int32_t* first_in_cell;
  int cell_bits;

  static RayBundle of(const BeamFan& fan) {
    return {fan.x(),          fan.y(),          fan.count(),
            fan.min_length(), fan.max_length(), fan.first_in_cell(),
            fan.cell_bits()};
  }
};

// How fixtures are hit, for scans that find out which ones are. A ray passes a fixture that
// transmits if a random word is below its limit: `fate_word` of the word of the ray and of the slot
// of the fixture with the bits of the leg.
struct HitRules {
  static constexpr std::uint32_t kNoFixture = 0xFFFFFFFFU;
  // The legs of a path: before and after a reflection.
  static constexpr std::uint32_t kDirect = 0;
  static constexpr std::uint32_t kReflected = 0x80000000U;
  // The brightness of a hit, before a reflection, that reflects the ray as a mirror.
  static constexpr float kReflects = -1.0F;

  const Materials* materials;  // null if all fixtures are opaque
  const std::uint32_t* words;  // for each ray in sorted order, whole blocks; see `draw_words`
  std::uint32_t leg;
  std::uint32_t excluded;   // a fixture that is not hit, or kNoFixture
  std::uint16_t preferred;  // of two coincident edges, the one with these categories is hit
};

// Half of the world.
struct HalfPlane {
  b2Vec2 normal;  // unit vector, to the inside
  float offset;   // of the boundary from the origin of a scan, along the normal [m]
};

class DepthScan {
 public:
  // The fan and the buffer must outlive the scan. Initially all rays are misses.
  DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer)
      : DepthScan(RayBundle::of(fan), pose, buffer, nullptr) {}
  // A scan that also finds the fixtures, at about 1.2 times the cost. The rules must outlive it.
  DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer, const HitRules& rules)
      : DepthScan(RayBundle::of(fan), pose, buffer, &rules) {}
  // A scan of some rays, from `first` to `last` - 1; those from `count` on are the first ones of
  // the bundle again. The caller makes the rays misses that are to be cast, and sets their
  // `nearest` fractions. Fixtures outside of the half-plane may be skipped.
  DepthScan(const RayBundle& rays, std::size_t first, std::size_t last, const HalfPlane& inside,
            const b2Transform& pose, ScanBuffer& buffer, const HitRules& rules);

  // Draws the edges of a tree; `body` is the pose of the frame of the tree.
  void draw(const EdgeTree& tree, const b2Transform& body, RayMasks masks);
  // Draws circles and polygons.
  void draw(const SolidTree& solids, RayMasks masks);

  // Fraction of the nearest hit of each ray, in sorted order; greater than 1 for a miss. While
  // drawing, hits at or beyond these fractions are ignored; the caller may change them in between.
  float* fractions() { return buffer_.fraction.data(); }
  const float* fractions() const { return buffer_.fraction.data(); }
  // Ignores hits of each ray at lower fractions than these, which are initially 0; only for scans
  // that find fixtures.
  float* limit_nearest();

 private:
  DepthScan(const RayBundle& rays, const b2Transform& pose, ScanBuffer& buffer,
            const HitRules* rules);

  bool is_empty() const { return first_ == last_; }
  void set_frame(const ScanView& view, const ScanFrame& frame, const b2Transform& body);
  ScanView view() const;
  HitView hits(const b2Rot& body) const;
  // The relation of the rays to the world.
  ScanFrame world_frame(const ScanView& view, RayMasks masks);

  RayBundle rays_;
  b2Transform pose_;
  ScanBuffer& buffer_;
  const HitRules* rules_;
  bool has_nearest_ = false;
  HalfPlane inside_{{0.0F, 0.0F}, 0.0F};
  b2Transform frame_;  // of the vectors along the rays in the buffer, that of the tree drawn last
  bool has_frame_ = false;
  std::int32_t first_ = 0, last_;
};

}  // namespace flatland
