#include "rays/depth_scan.h"

#include <box2d/b2_body.h>
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_polygon_shape.h>

#include <algorithm>
#include <cmath>

#include "rays/instruction_set.h"
#include "rays/simd.h"
#if defined(__x86_64__)
#include "rays/simd_x86.h"
#endif

namespace flatland {

static_assert(AlignedFloats::kBlock % simd::kWidth == 0, "a block consists of whole vectors");

// A half-open range of ray numbers, which begins within the full circle and may extend beyond.
struct Interval {
  std::int32_t begin, end;
};

// The hits of a scan that finds fixtures; see HitRules.
struct HitView {
  const float* nearest;  // null if there are no limits
  float* fixture;
  float* brightness;
  const std::uint16_t* number;  // number of the material of a fixture, by slot
  std::size_t count;            // size of `number`; fixtures with greater slots have no material
  const Optics* optics;         // by number of the material
  bool uses_materials;
  const std::uint32_t* words;
  std::uint32_t leg, excluded;
  std::uint16_t preferred;
  // The half-plane that contains all hits, in the current frame and relative to the origin of the
  // rays.
  b2Vec2 front;
  float front_distance;
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
  // The origin of the rays in the frame of the body, the rotation from this frame to the frame of
  // the fan, and a bound of the error of a diamond angle.
  b2Vec2 origin;
  float cos_to_sensor, sin_to_sensor;
  float margin;
  RayMasks masks;
};

// A SolidTree for the inner loops.
struct SolidView {
  const SolidGroup* loose;
  std::size_t loose_count;
  const EdgeTree::Node* nodes;  // null if all solids are loose
  const SolidGroup* groups;
};

namespace {

std::uint32_t slot_of(const b2Fixture& fixture) {
  return static_cast<std::uint32_t>(const_cast<b2Fixture&>(fixture).GetUserData().pointer);
}

// A node or leaf that is not drawn yet.
struct StackEntry {
  float distance;
  Interval rays;
  std::uint32_t child;
};

// The objects, up to eight, that rays may hit, with the range of rays and a lower bound of the
// distance of each object.
struct Candidates {
  std::uint32_t set;
  std::int32_t begin[simd::kWidth], end[simd::kWidth];
  float distance[simd::kWidth];
};

const Optics kPlain;
constexpr std::uint16_t kNoMaterial[EdgeTree::kFanOut] = {};

// A box counts as surrounding the origin of the rays if the distance of the box is at most this
// fraction of its size. The same number is the margin [diamond angle] by which an object must span
// less than a half circle.
constexpr float kNearTolerance = 1e-3F;
// Factors that turn computed distances into lower bounds. The first factor covers the rounding of
// the distance of a box. The second factor covers the error of the formula of Box2D for circles,
// which takes the square root of a difference of large numbers.
constexpr float kBoxRounding = 1.0F - 1e-5F;
constexpr float kCircleRounding = 1.0F - 1e-3F;
// The margin by which a box is enlarged for the rays of a bundle because of rounding, as a fraction
// of the largest coordinate.
constexpr float kBundleTolerance = 1e-5F;
constexpr auto kBundle = static_cast<std::int32_t>(RayBundle::kMaxInAnyOrder);
// Up to this number of vectors of rays, drawing all edges of a leaf costs less than finding the
// rays that each edge covers.
constexpr std::int32_t kFewVectors = 3;
// An edge is seen edge-on if the distance of its line from the origin of the rays is at most this
// fraction of the distances of its ends.
constexpr float kEdgeOn = 1e-4F;
// The origin of the rays counts as inside a circle only by a margin, this fraction of the squared
// radius.
constexpr float kInside = 1e-3F;

struct Functions {
  void (*set_frame)(const ScanView&, const ScanFrame&, const b2Transform&);
  void (*draw_tree)(const ScanView&, const ScanFrame&, const EdgeTree::Node*,
                    const EdgeTree::Leaf*);
  void (*draw_solids)(const ScanView&, const ScanFrame&, const SolidView&);
  void (*find_in_tree)(const ScanView&, const ScanFrame&, const HitView&, const EdgeTree::Node*,
                       const EdgeTree::Leaf*, const EdgeTree::LeafFixtures*);
  void (*find_in_solids)(const ScanView&, const ScanFrame&, const HitView&, const SolidView&);
};

#define FLATLAND_KERNEL "rays/depth_kernel.h"
#include "rays/every_instruction_set.h"

// Returns a bound of the difference between the diamond angle of a ray in the frame of a body and
// in the fan. The rounding of coordinates causes the difference, which is largest for short rays
// far from the origin of the world.
float angle_margin(const RayBundle& rays, const b2Transform& pose, const b2Transform& body) {
  const float coordinates = pose.p.Length() + body.p.Length() + rays.max_length;
  constexpr float kFullCircle = 4.0F;
  return std::min(4e-6F + 1e-6F * coordinates / rays.min_length, kFullCircle);
}

}  // namespace

DepthScan::DepthScan(const RayBundle& rays, const b2Transform& pose, ScanBuffer& buffer,
                     const HitRules* rules)
    : rays_(rays),
      pose_(pose),
      buffer_(buffer),
      rules_(rules),
      last_(static_cast<std::int32_t>(rays.count)) {
  buffer.d_x.resize(rays.count);
  buffer.d_y.resize(rays.count);
  // A vector may begin at any ray, so that the arrays need a further block.
  buffer.fraction.resize(rays.count + AlignedFloats::kBlock);
  std::fill_n(buffer.fraction.data(), buffer.fraction.size(), kMissFraction);
  if (rules == nullptr) return;
  buffer.fixture.resize(rays.count);
  buffer.brightness.resize(rays.count);
  std::fill_n(buffer.brightness.data(), buffer.brightness.size(), 0.0F);
}

DepthScan::DepthScan(const RayBundle& rays, std::size_t first, std::size_t last,
                     const HalfPlane& inside, const b2Transform& pose, ScanBuffer& buffer,
                     const HitRules& rules)
    : rays_(rays),
      pose_(pose),
      buffer_(buffer),
      rules_(&rules),
      has_nearest_(true),
      inside_(inside),
      first_(static_cast<std::int32_t>(first)),
      last_(static_cast<std::int32_t>(last)) {
  for (AlignedFloats* array : {&buffer.d_x, &buffer.d_y, &buffer.fraction, &buffer.nearest,
                               &buffer.fixture, &buffer.brightness}) {
    if (array->size() < rays.count) array->resize(rays.count);
  }
  // The other rays in the same vectors have a fraction of -1, so that no hit is nearer.
  constexpr std::size_t kBlock = AlignedFloats::kBlock;
  const auto clear = [&](std::size_t begin, std::size_t end) {
    begin = begin / kBlock * kBlock;
    std::fill(buffer.fraction.data() + begin, buffer.fraction.data() + AlignedFloats::rounded(end),
              -1.0F);
  };
  clear(first, std::min(last, rays.count));
  if (last > rays.count) clear(0, last - rays.count);
}

float* DepthScan::limit_nearest() {
  has_nearest_ = true;
  buffer_.nearest.resize(rays_.count);
  std::fill_n(buffer_.nearest.data(), buffer_.nearest.size(), 0.0F);
  return buffer_.nearest.data();
}

ScanView DepthScan::view() const {
  // The factor is slightly less than the reciprocal, so that rounding has no effect.
  const float fraction_per_metre = (1.0F - 1e-6F) / rays_.max_length;
  return {rays_.x,
          rays_.y,
          rays_.first_in_cell,
          rays_.cell_bits,
          static_cast<std::int32_t>(rays_.count),
          {first_, last_},
          buffer_.d_x.data(),
          buffer_.d_y.data(),
          buffer_.fraction.data(),
          fraction_per_metre,
          pose_};
}

HitView DepthScan::hits(const b2Rot& body) const {
  const Materials* materials = rules_->materials;
  const bool uses_materials = materials != nullptr;
  return {has_nearest_ ? buffer_.nearest.data() : nullptr,
          buffer_.fixture.data(),
          buffer_.brightness.data(),
          uses_materials ? materials->numbers().data() : nullptr,
          uses_materials ? materials->numbers().size() : 0,
          uses_materials ? materials->optics().data() : &kPlain,
          uses_materials,
          rules_->words,
          rules_->leg,
          rules_->excluded,
          rules_->preferred,
          b2MulT(body, inside_.normal),
          inside_.offset};
}

void DepthScan::set_frame(const ScanView& view, const ScanFrame& frame, const b2Transform& body) {
  const bool is_same =
      has_frame_ && frame_.p == body.p && frame_.q.s == body.q.s && frame_.q.c == body.q.c;
  if (!is_same) functions().set_frame(view, frame, body);
  frame_ = body;
  has_frame_ = true;
}

ScanFrame DepthScan::world_frame(const ScanView& view, RayMasks masks) {
  b2Transform world;
  world.SetIdentity();
  const ScanFrame frame{pose_.p, pose_.q.c, -pose_.q.s, angle_margin(rays_, pose_, world), masks};
  if (rays_.first_in_cell == nullptr) set_frame(view, frame, world);
  return frame;
}

void DepthScan::draw(const EdgeTree& tree, const b2Transform& body, RayMasks masks) {
  if (tree.nodes().empty() || !masks.pass(tree.category_bits()) || is_empty()) return;
  const b2Rot to_sensor = b2MulT(pose_.q, body.q);
  const ScanFrame frame{b2MulT(body.q, pose_.p - body.p), to_sensor.c, to_sensor.s,
                        angle_margin(rays_, pose_, body), masks};
  const ScanView view = this->view();
  set_frame(view, frame, body);
  if (rules_ == nullptr) {
    functions().draw_tree(view, frame, tree.nodes().data(), tree.leaves().data());
  } else {
    functions().find_in_tree(view, frame, hits(body.q), tree.nodes().data(), tree.leaves().data(),
                             tree.leaf_fixtures().data());
  }
}

void DepthScan::draw(const SolidTree& tree, RayMasks masks) {
  if (tree.is_empty() || is_empty()) return;
  const ScanView view = this->view();
  const ScanFrame frame = world_frame(view, masks);
  const SolidView solids{tree.loose().data(), tree.loose().size(),
                         tree.nodes().empty() ? nullptr : tree.nodes().data(),
                         tree.groups().data()};
  if (rules_ == nullptr) {
    functions().draw_solids(view, frame, solids);
  } else {
    functions().find_in_solids(view, frame, hits(b2Rot(0.0F)), solids);
  }
}

}  // namespace flatland
