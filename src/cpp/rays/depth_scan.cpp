#include "rays/depth_scan.h"

#include <box2d/b2_body.h>
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_polygon_shape.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "rays/instruction_set.h"
#include "rays/simd.h"
#if defined(__x86_64__)
#include "rays/simd_x86.h"
#endif

namespace flatland {
namespace {

static_assert(AlignedFloats::kBlock % simd::kWidth == 0, "a block consists of whole vectors");

// A half-open range of ray numbers. It begins within the full circle and may extend beyond it.
struct Interval {
  std::int32_t begin, end;
};

// The hits of a scan that finds fixtures; see HitRules.
struct HitView {
  const float* nearest;  // null if there are no limits
  float* fixture;
  const std::uint16_t* number;  // of the material of a fixture, by its slot
  std::size_t count;            // of these numbers; fixtures with other slots have no material
  const std::uint32_t* pass_limit;
  const std::uint32_t* words;
  std::uint32_t leg, excluded;
  std::uint16_t preferred;
  float least_distance;  // [m]; hits are not nearer
};

std::uint32_t slot_of(const b2Fixture& fixture) {
  return static_cast<std::uint32_t>(const_cast<b2Fixture&>(fixture).GetUserData().pointer);
}

// A node or leaf that remains to be drawn.
struct StackEntry {
  float distance;
  Interval rays;
  std::uint32_t child;
};

// Rays that may hit each of eight objects, and lower bounds of the distances of the objects.
struct Candidates {
  std::int32_t begin[simd::kWidth], end[simd::kWidth];
  float distance[simd::kWidth];
};

// The rays of a scan and their hits, for the inner loops. Arrays have whole blocks.
struct ScanView {
  const float *fan_x, *fan_y;
  const std::int32_t* first_in_cell;
  int cell_bits;
  std::int32_t count;
  Interval drawn;    // the rays that may have hits
  float *d_x, *d_y;  // vector along each ray in the current frame
  float* fraction;
  float fraction_per_metre;  // lower bound for all rays
  b2Transform pose;
};

// The relation of the rays to the frame of a body.
struct ScanFrame {
  // Origin of the rays in the frame, rotation from the frame to that of the fan, and bound of the
  // error of a diamond angle.
  b2Vec2 origin;
  float cos_to_sensor, sin_to_sensor;
  float margin;
  RayMasks masks;
};

// A box is assumed to surround the origin of the rays if its distance is at most this fraction of
// its size. Also the margin [diamond angle] by which an object must span less than a half circle.
constexpr float kNearTolerance = 1e-3F;
// Factors that turn computed distances into lower bounds: the first one covers the rounding of the
// distance of a box, the second one the error of the formula of Box2D for circles, which takes the
// square root of a difference of large numbers.
constexpr float kBoxRounding = 1.0F - 1e-5F;
constexpr float kCircleRounding = 1.0F - 1e-3F;
// Up to this number of vectors of rays, drawing all edges of a leaf costs less than finding the
// rays that each edge covers.
constexpr std::int32_t kFewVectors = 3;
// The distance of the line of an edge seen edge-on from the origin of the rays, as a part of the
// distances of its ends.
constexpr float kEdgeOn = 1e-4F;
// Part of the squared radius by which the origin of the rays must be inside a circle.
constexpr float kInside = 1e-3F;

// The same code is compiled for several instruction sets, one of which is selected at run time.
namespace baseline {
using Lanes = simd::Lanes8;
#include "rays/depth_kernel.h"
}  // namespace baseline

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
using Lanes = simd::Lanes8Avx2;
#include "rays/depth_kernel.h"
}  // namespace avx2
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw")
namespace avx512 {
using Lanes = simd::Lanes16;
#include "rays/depth_kernel.h"
}  // namespace avx512
#pragma GCC pop_options
#endif

struct Functions {
  decltype(&baseline::set_frame) set_frame;
  decltype(&baseline::draw_tree) draw_tree;
  decltype(&baseline::draw_solids) draw_solids;
  decltype(&baseline::draw_solid_tree) draw_solid_tree;
  decltype(&baseline::find_in_tree) find_in_tree;
  decltype(&baseline::find_in_solids) find_in_solids;
  decltype(&baseline::find_in_solid_tree) find_in_solid_tree;
};

const Functions& functions() {
  static const Functions kSelected = [] {
#if defined(__x86_64__)
    switch (instruction_set()) {
      case InstructionSet::kAvx512:
        return Functions{avx512::set_frame,         avx512::draw_tree,    avx512::draw_solids,
                         avx512::draw_solid_tree,   avx512::find_in_tree, avx512::find_in_solids,
                         avx512::find_in_solid_tree};
      case InstructionSet::kAvx2:
        return Functions{avx2::set_frame,         avx2::draw_tree,    avx2::draw_solids,
                         avx2::draw_solid_tree,   avx2::find_in_tree, avx2::find_in_solids,
                         avx2::find_in_solid_tree};
      case InstructionSet::kBaseline:
        break;
    }
#endif
    return Functions{baseline::set_frame,         baseline::draw_tree,    baseline::draw_solids,
                     baseline::draw_solid_tree,   baseline::find_in_tree, baseline::find_in_solids,
                     baseline::find_in_solid_tree};
  }();
  return kSelected;
}

ScanView view_of(const BeamFan& fan, Interval drawn, const b2Transform& pose, ScanBuffer& buffer) {
  // A bit less than the reciprocal, so that rounding does not matter.
  const float fraction_per_metre = (1.0F - 1e-6F) / fan.max_length();
  return {fan.x(),
          fan.y(),
          fan.first_in_cell(),
          fan.cell_bits(),
          static_cast<std::int32_t>(fan.count()),
          drawn,
          buffer.d_x.data(),
          buffer.d_y.data(),
          buffer.fraction.data(),
          fraction_per_metre,
          pose};
}

HitView hits_of(const HitRules& rules, ScanBuffer& buffer, bool has_nearest, float least_distance) {
  const Materials& materials = *rules.materials;
  return {has_nearest ? buffer.nearest.data() : nullptr,
          buffer.fixture.data(),
          materials.numbers().data(),
          materials.numbers().size(),
          materials.pass_limits().data(),
          rules.words,
          rules.leg,
          rules.excluded,
          rules.preferred,
          least_distance};
}

// Bound of the difference between the diamond angle of a ray in the frame of a body and in the fan.
// It is caused by the rounding of coordinates and is largest for short rays far from the origin of
// the world.
float angle_margin(const BeamFan& fan, const b2Transform& pose, const b2Transform& body) {
  const float coordinates = pose.p.Length() + body.p.Length() + fan.max_length();
  constexpr float kFullCircle = 4.0F;
  return std::min(4e-6F + 1e-6F * coordinates / fan.min_length(), kFullCircle);
}

ScanFrame world_frame(const BeamFan& fan, const b2Transform& pose, RayMasks masks) {
  b2Transform world;
  world.SetIdentity();
  return {pose.p, pose.q.c, -pose.q.s, angle_margin(fan, pose, world), masks};
}

}  // namespace

DepthScan::DepthScan(const BeamFan& fan, const b2Transform& pose, ScanBuffer& buffer,
                     const HitRules* rules)
    : fan_(fan),
      pose_(pose),
      buffer_(buffer),
      rules_(rules),
      last_(static_cast<std::int32_t>(fan.count())) {
  buffer.d_x.resize(fan.count());
  buffer.d_y.resize(fan.count());
  // Whole vectors are read from the start of any run of rays on.
  buffer.fraction.resize(fan.count() + AlignedFloats::kBlock);
  std::fill_n(buffer.fraction.data(), buffer.fraction.size(), kMissFraction);
  if (rules == nullptr) return;
  buffer.fixture.resize(fan.count());
  std::memset(buffer.fixture.data(), 0xFF, buffer.fixture.size() * sizeof(float));
}

float* DepthScan::limit_nearest() {
  has_nearest_ = true;
  buffer_.nearest.resize(fan_.count());
  std::fill_n(buffer_.nearest.data(), buffer_.nearest.size(), 0.0F);
  return buffer_.nearest.data();
}

void DepthScan::draw(const EdgeTree& tree, const b2Transform& body, RayMasks masks) {
  if (tree.nodes().empty() || !masks.pass(tree.category_bits()) || fan_.count() == 0) return;
  const ScanView view = view_of(fan_, {first_, last_}, pose_, buffer_);
  const b2Rot to_sensor = b2MulT(pose_.q, body.q);
  const ScanFrame frame{b2MulT(body.q, pose_.p - body.p), to_sensor.c, to_sensor.s,
                        angle_margin(fan_, pose_, body), masks};
  const bool is_same =
      has_frame_ && frame_.p == body.p && frame_.q.s == body.q.s && frame_.q.c == body.q.c;
  if (!is_same) functions().set_frame(view, frame, body);
  frame_ = body;
  has_frame_ = true;
  if (rules_ == nullptr) {
    functions().draw_tree(view, frame, tree.nodes().data(), tree.leaves().data());
  } else {
    functions().find_in_tree(view, frame, hits_of(*rules_, buffer_, has_nearest_, least_distance_),
                             tree.nodes().data(), tree.leaves().data(),
                             tree.leaf_fixtures().data());
  }
}

void DepthScan::draw(const std::vector<b2Fixture*>& solids, RayMasks masks) {
  if (solids.empty() || fan_.count() == 0) return;
  const ScanView view = view_of(fan_, {first_, last_}, pose_, buffer_);
  const ScanFrame frame = world_frame(fan_, pose_, masks);
  if (rules_ == nullptr) {
    functions().draw_solids(view, frame, solids.data(), solids.size());
  } else {
    functions().find_in_solids(view, frame,
                               hits_of(*rules_, buffer_, has_nearest_, least_distance_),
                               solids.data(), solids.size());
  }
}

void DepthScan::draw(const SolidTree& tree, RayMasks masks) {
  draw(tree.loose(), masks);
  if (tree.is_empty() || fan_.count() == 0) return;
  const ScanView view = view_of(fan_, {first_, last_}, pose_, buffer_);
  const ScanFrame frame = world_frame(fan_, pose_, masks);
  const std::vector<b2Fixture*>& solids = tree.solids();
  if (rules_ == nullptr) {
    functions().draw_solid_tree(view, frame, tree.nodes().data(), solids.data(), solids.size());
  } else {
    functions().find_in_solid_tree(view, frame,
                                   hits_of(*rules_, buffer_, has_nearest_, least_distance_),
                                   tree.nodes().data(), solids.data(), solids.size());
  }
}

}  // namespace flatland
