#include "rays/depth_scan.h"

#include <box2d/b2_body.h>
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_polygon_shape.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "rays/simd.h"

namespace flatland {

using simd::Floats;
using simd::Ints;
using simd::kWidth;

namespace {

static_assert(BeamFan::kPadding + 1 == kWidth, "a vector can start at any ray");

// A half-open range of ray numbers, which continue beyond the full circle in both directions.
struct Interval {
  std::int32_t begin, end;
};

// A node or leaf that remains to be drawn.
struct StackEntry {
  float distance;
  Interval rays;
  std::uint32_t child;
};

// Rays that may hit each of eight objects, and lower bounds of the distances of the objects.
struct Candidates {
  std::int32_t begin[kWidth], end[kWidth];
  float distance[kWidth];
};

// A box is assumed to surround the origin of the rays if its distance is at most this fraction of
// its size. Also the margin [diamond angle] by which an object must span less than a half circle.
constexpr float kNearTolerance = 1e-3F;
// Factors that turn computed distances into lower bounds: the first one covers the rounding of the
// distance of a box, the second one the error of the formula of Box2D for circles, which takes the
// square root of a difference of large numbers.
constexpr float kBoxRounding = 1.0F - 1e-5F;
constexpr float kCircleRounding = 1.0F - 1e-3F;

}  // namespace

// The inner loops. All of them are inlined into functions that are compiled once for each
// instruction set.
struct DepthScanKernel {
  DepthScan& scan;
  const BeamFan& fan = scan.fan_;
  // Origin of the rays in the current frame, rotation from the current frame to the frame of the
  // fan, and bound of the error of a diamond angle.
  b2Vec2 origin;
  float cos_to_sensor, sin_to_sensor;
  float margin;
  RayMasks masks;

  FLATLAND_INLINE std::int32_t ray_count() const { return static_cast<std::int32_t>(fan.count()); }

  FLATLAND_INLINE Floats angle_in_sensor(Floats x, Floats y) const {
    return simd::diamond_angle(cos_to_sensor * x - sin_to_sensor * y,
                               sin_to_sensor * x + cos_to_sensor * y);
  }

  // Finds the rays between two angles, or all rays where `is_all`.
  FLATLAND_INLINE void find_rays(Floats low, Floats high, Ints is_all, Candidates& out) const {
    const float cells_per_unit = static_cast<float>(fan.cells()) / 4.0F;
    // An angle is NaN if a point coincides with the origin; `is_all` is set in these lanes.
    const Floats zero = simd::broadcast(0.0F);
    std::int32_t first[kWidth], last[kWidth], all[kWidth];
    simd::store(first, simd::floor(is_all ? zero : (low - margin) * cells_per_unit));
    simd::store(last, simd::floor(is_all ? zero : (high + margin) * cells_per_unit));
    simd::store(all, is_all);
    for (std::size_t i = 0; i < kWidth; ++i) {
      out.begin[i] = all[i] != 0 ? 0 : fan.first_in(first[i]);
      out.end[i] = all[i] != 0 ? ray_count() : fan.first_in(last[i] + 1);
    }
  }

  // Finds the rays covered by eight boxes, and the distances of the boxes.
  FLATLAND_INLINE void find_boxes(const float* min_x, const float* min_y, const float* max_x,
                                  const float* max_y, Candidates& out) const {
    const Floats x0 = simd::load(min_x) - origin.x;
    const Floats x1 = simd::load(max_x) - origin.x;
    const Floats y0 = simd::load(min_y) - origin.y;
    const Floats y1 = simd::load(max_y) - origin.y;
    const Floats zero = simd::broadcast(0.0F);
    const Floats outside_x = simd::max(simd::max(x0, -x1), zero);
    const Floats outside_y = simd::max(simd::max(y0, -y1), zero);
    const Floats distance = simd::sqrt(outside_x * outside_x + outside_y * outside_y);
    const Floats size = (x1 - x0) + (y1 - y0);

    // The silhouette of a box consists of two of its corners, its rightmost and its leftmost one
    // when viewed from the origin.
    const Ints is_right = x0 > 0.0F, is_left = x1 < 0.0F;
    const Ints is_above = y0 > 0.0F, is_below = y1 < 0.0F;
    const Floats near_x = is_right ? x0 : x1;
    const Floats near_y = is_above ? y0 : y1;
    const Floats low_x = is_above ? x1 : (is_below ? x0 : near_x);
    const Floats high_x = is_above ? x0 : (is_below ? x1 : near_x);
    const Floats low_y = is_right ? y0 : (is_left ? y1 : near_y);
    const Floats high_y = is_right ? y1 : (is_left ? y0 : near_y);
    const Floats from = angle_in_sensor(low_x, low_y);
    const Floats turn = simd::wrap_difference(angle_in_sensor(high_x, high_y) - from);
    const Ints is_near = distance <= kNearTolerance * size;
    // False for NaN.
    const Ints is_partial = simd::abs(turn) <= 2.0F - kNearTolerance;
    find_rays(from + simd::min(turn, zero), from + simd::max(turn, zero), is_near | ~is_partial,
              out);
    simd::store(out.distance, distance * kBoxRounding);
  }

  // Calls visit(ray, count) for consecutive groups of eight rays that together contain the
  // interval, until visit returns true. `ray` is the first ray of a group and `count` the number of
  // rays from there to the end of the interval. Returns whether a call returned true.
  template <typename Visit>
  FLATLAND_INLINE bool any_of(Interval rays, Visit&& visit) const {
    const std::int32_t count = ray_count();
    if (rays.end - rays.begin >= count) {
      rays = {0, count};
    } else if (rays.begin < 0) {
      rays.begin += count;
      rays.end += count;
    } else if (rays.begin >= count) {
      rays.begin -= count;
      rays.end -= count;
    }
    const auto visit_run = [&](std::int32_t begin, std::int32_t end) {
      for (std::int32_t ray = begin; ray < end; ray += kWidth) {
        if (visit(static_cast<std::size_t>(ray), end - ray)) return true;
      }
      return false;
    };
    if (visit_run(rays.begin, std::min(rays.end, count))) return true;
    return rays.end > count && visit_run(0, rays.end - count);
  }

  // Whether one of the rays reaches a distance.
  FLATLAND_INLINE bool is_visible(Interval rays, float distance) const {
    return any_of(rays, [&](std::size_t ray, std::int32_t count_left) {
      return simd::any((simd::load(&scan.reach_[ray]) >= distance) & simd::first_lanes(count_left));
    });
  }

  // Records the hits of eight rays that are nearer than their previous ones; NaN is a miss.
  FLATLAND_INLINE void record_hits(std::size_t ray, Floats fraction, Ints is_hit) const {
    const Floats before = simd::load(&scan.fractions_[ray]);
    is_hit &= (fraction >= 0.0F) & (fraction < before);
    const Floats after = is_hit ? fraction : before;
    simd::store(&scan.fractions_[ray], after);
    simd::store(&scan.reach_[ray], after * simd::load(fan.length() + ray));
  }

  FLATLAND_INLINE void draw_edge(b2Vec2 a, b2Vec2 b, b2Vec2 normal, float numerator,
                                 Interval rays) const {
    any_of(rays, [&](std::size_t ray, std::int32_t) {
      const Floats d_x = simd::load(&scan.d_x_[ray]);
      const Floats d_y = simd::load(&scan.d_y_[ray]);
      const Floats side_a = d_x * a.y - d_y * a.x;
      const Floats side_b = d_x * b.y - d_y * b.x;
      const Ints is_crossed =
          (simd::min(side_a, side_b) <= 0.0F) & (simd::max(side_a, side_b) >= 0.0F);
      const Floats denominator = normal.x * d_x + normal.y * d_y;
      record_hits(ray, numerator / denominator, is_crossed & (denominator != 0.0F));
      return false;
    });
  }

  FLATLAND_INLINE void draw_leaf(const EdgeTree::Leaf& leaf) const {
    const Floats a_x = simd::load(leaf.x1) - origin.x;
    const Floats a_y = simd::load(leaf.y1) - origin.y;
    const Floats b_x = simd::load(leaf.x2) - origin.x;
    const Floats b_y = simd::load(leaf.y2) - origin.y;
    const Floats numerator = simd::load(leaf.normal_x) * a_x + simd::load(leaf.normal_y) * a_y;
    const Floats from = angle_in_sensor(a_x, a_y);
    const Floats turn = simd::wrap_difference(angle_in_sensor(b_x, b_y) - from);
    const Floats zero = simd::broadcast(0.0F);
    const Ints is_partial = simd::abs(turn) < 2.0F - kNearTolerance;
    Candidates rays;
    find_rays(from + simd::min(turn, zero), from + simd::max(turn, zero), ~is_partial, rays);
    for (std::uint32_t i = 0; i < leaf.count; ++i) {
      if (!masks.pass(leaf.category_bits[i]) && !masks.pass(leaf.coincident_bits[i])) continue;
      draw_edge({a_x[i], a_y[i]}, {b_x[i], b_y[i]}, {leaf.normal_x[i], leaf.normal_y[i]},
                numerator[i], {rays.begin[i], rays.end[i]});
    }
  }

  FLATLAND_INLINE void draw_tree(const EdgeTree& tree) const {
    StackEntry stack[EdgeTree::kMaxDepth * EdgeTree::kFanOut];
    std::size_t size = 0;
    stack[size++] = {0.0F, {0, ray_count()}, 0};
    while (size > 0) {
      const StackEntry next = stack[--size];
      if (!is_visible(next.rays, next.distance)) continue;
      if ((next.child & EdgeTree::kLeafBit) != 0) {
        draw_leaf(tree.leaves()[next.child & ~EdgeTree::kLeafBit]);
        continue;
      }
      const EdgeTree::Node& node = tree.nodes()[next.child];
      Candidates candidates;
      find_boxes(node.min_x, node.min_y, node.max_x, node.max_y, candidates);
      const std::size_t first = size;
      for (std::uint32_t i = 0; i < node.count; ++i) {
        const Interval rays{candidates.begin[i], candidates.end[i]};
        const float distance = candidates.distance[i];
        if (!masks.pass(node.category_bits[i]) || !is_visible(rays, distance)) continue;
        // Insertion sort, with the nearest entry on top of the stack.
        std::size_t top = size++;
        for (; top > first && stack[top - 1].distance < distance; --top) {
          stack[top] = stack[top - 1];
        }
        stack[top] = {distance, rays, node.child[i]};
      }
    }
  }

  FLATLAND_INLINE void draw_circle(const b2CircleShape& circle, const b2Transform& body,
                                   Interval rays) const {
    const b2Vec2 position = body.p + b2Mul(body.q, circle.m_p);
    const b2Vec2 s = scan.pose_.p - position;
    const float b = b2Dot(s, s) - circle.m_radius * circle.m_radius;
    any_of(rays, [&](std::size_t ray, std::int32_t) {
      const Floats r_x = simd::load(&scan.end_x_[ray]) - scan.pose_.p.x;
      const Floats r_y = simd::load(&scan.end_y_[ray]) - scan.pose_.p.y;
      const Floats c = s.x * r_x + s.y * r_y;
      const Floats rr = r_x * r_x + r_y * r_y;
      const Floats sigma = c * c - rr * b;
      const Floats root = simd::sqrt(simd::max(sigma, simd::broadcast(0.0F)));
      const Floats a = -(c + root);
      record_hits(ray, a / rr, (sigma >= 0.0F) & (rr >= b2_epsilon) & (a <= rr));
      return false;
    });
  }

  FLATLAND_INLINE void draw_polygon(const b2PolygonShape& polygon, const b2Transform& body,
                                    Interval rays) const {
    const b2Vec2 p1 = b2MulT(body.q, scan.pose_.p - body.p);
    any_of(rays, [&](std::size_t ray, std::int32_t) {
      const Floats world_x = simd::load(&scan.end_x_[ray]) - body.p.x;
      const Floats world_y = simd::load(&scan.end_y_[ray]) - body.p.y;
      const Floats d_x = (body.q.c * world_x + body.q.s * world_y) - p1.x;
      const Floats d_y = (-body.q.s * world_x + body.q.c * world_y) - p1.y;
      Floats lower = simd::broadcast(0.0F);
      Floats upper = simd::broadcast(1.0F);
      Ints enters = {};
      Ints misses = {};
      for (int32 i = 0; i < polygon.m_count; ++i) {
        const b2Vec2 normal = polygon.m_normals[i];
        const float numerator = b2Dot(normal, polygon.m_vertices[i] - p1);
        const Floats denominator = normal.x * d_x + normal.y * d_y;
        const Floats fraction = numerator / denominator;
        const Ints is_entry = (denominator < 0.0F) & (numerator < lower * denominator);
        const Ints is_exit = (denominator > 0.0F) & (numerator < upper * denominator);
        if (numerator < 0.0F) misses |= denominator == 0.0F;
        lower = is_entry ? fraction : lower;
        upper = is_exit ? fraction : upper;
        enters |= is_entry;
      }
      record_hits(ray, lower, enters & ~misses & (lower <= upper));
      return false;
    });
  }

  FLATLAND_INLINE void draw_solids(const std::vector<b2Fixture*>& solids) const {
    for (std::size_t first = 0; first < solids.size(); first += kWidth) {
      const std::size_t count = std::min(kWidth, solids.size() - first);
      float min_x[kWidth], min_y[kWidth], max_x[kWidth], max_y[kWidth];
      for (std::size_t i = 0; i < kWidth; ++i) {
        const b2AABB& box = solids[first + std::min(i, count - 1)]->GetAABB(0);
        // Enlarged like the boxes in the broad phase of Box2D. Due to rounding, Box2D can report a
        // hit on a circle outside of the box of the circle.
        min_x[i] = box.lowerBound.x - b2_aabbExtension;
        min_y[i] = box.lowerBound.y - b2_aabbExtension;
        max_x[i] = box.upperBound.x + b2_aabbExtension;
        max_y[i] = box.upperBound.y + b2_aabbExtension;
      }
      Candidates candidates;
      find_boxes(min_x, min_y, max_x, max_y, candidates);
      for (std::size_t i = 0; i < count; ++i) {
        const b2Fixture& fixture = *solids[first + i];
        const Interval rays{candidates.begin[i], candidates.end[i]};
        if (fixture.IsSensor() || !masks.pass(fixture.GetFilterData().categoryBits) ||
            !is_visible(rays, candidates.distance[i] * kCircleRounding)) {
          continue;
        }
        const b2Transform& body = fixture.GetBody()->GetTransform();
        if (fixture.GetType() == b2Shape::e_circle) {
          draw_circle(*static_cast<const b2CircleShape*>(fixture.GetShape()), body, rays);
        } else {
          draw_polygon(*static_cast<const b2PolygonShape*>(fixture.GetShape()), body, rays);
        }
      }
    }
  }
};

namespace {

// The same code is compiled for two instruction sets, one of which is selected at run time.
void draw_tree_baseline(const DepthScanKernel& kernel, const EdgeTree& tree) {
  kernel.draw_tree(tree);
}
void draw_solids_baseline(const DepthScanKernel& kernel, const std::vector<b2Fixture*>& solids) {
  kernel.draw_solids(solids);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) void draw_tree_avx2(const DepthScanKernel& kernel,
                                                    const EdgeTree& tree) {
  kernel.draw_tree(tree);
}
__attribute__((target("avx2"))) void draw_solids_avx2(const DepthScanKernel& kernel,
                                                      const std::vector<b2Fixture*>& solids) {
  kernel.draw_solids(solids);
}
bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}
#else
constexpr auto& draw_tree_avx2 = draw_tree_baseline;
constexpr auto& draw_solids_avx2 = draw_solids_baseline;
constexpr bool has_avx2() { return false; }
#endif

// Bound of the difference between the diamond angle of a ray in the frame of a body and in the fan.
// It is caused by the rounding of coordinates and is largest for short rays far from the origin of
// the world.
float angle_margin(const BeamFan& fan, const b2Transform& pose, const b2Transform& body) {
  const float coordinates = pose.p.Length() + body.p.Length() + fan.max_length();
  constexpr float kFullCircle = 4.0F;
  return std::min(4e-6F + 1e-6F * coordinates / fan.min_length(), kFullCircle);
}

}  // namespace

float DepthScan::miss_fraction() { return std::nextafter(1.0F, 2.0F); }

DepthScan::DepthScan(const BeamFan& fan, const b2Transform& pose)
    : fan_(fan),
      pose_(pose),
      end_x_(fan.padded_count()),
      end_y_(fan.padded_count()),
      d_x_(fan.padded_count()),
      d_y_(fan.padded_count()),
      fractions_(fan.padded_count(), miss_fraction()),
      reach_(fan.length(), fan.length() + fan.padded_count()) {
  for (std::size_t i = 0; i < end_x_.size(); ++i) {
    end_x_[i] = (pose.q.c * fan.x()[i] - pose.q.s * fan.y()[i]) + pose.p.x;
    end_y_[i] = (pose.q.s * fan.x()[i] + pose.q.c * fan.y()[i]) + pose.p.y;
  }
}

void DepthScan::set_limits(const std::vector<float>& fractions) {
  fractions_ = fractions;
  for (std::size_t i = 0; i < reach_.size(); ++i) reach_[i] = fractions[i] * fan_.length()[i];
}

void DepthScan::draw(const EdgeTree& tree, const b2Transform& body, RayMasks masks) {
  if (tree.nodes().empty() || !masks.pass(tree.category_bits()) || fan_.count() == 0) return;
  const b2Vec2 origin = b2MulT(body.q, pose_.p - body.p);
  const bool is_same =
      has_frame_ && frame_.p == body.p && frame_.q.s == body.q.s && frame_.q.c == body.q.c;
  if (!is_same) {
    for (std::size_t i = 0; i < d_x_.size(); ++i) {
      const float x = end_x_[i] - body.p.x;
      const float y = end_y_[i] - body.p.y;
      d_x_[i] = (body.q.c * x + body.q.s * y) - origin.x;
      d_y_[i] = (-body.q.s * x + body.q.c * y) - origin.y;
    }
    frame_ = body;
    has_frame_ = true;
  }
  const b2Rot to_sensor = b2MulT(pose_.q, body.q);
  const DepthScanKernel kernel{
      *this, fan_, origin, to_sensor.c, to_sensor.s, angle_margin(fan_, pose_, body), masks};
  (has_avx2() ? draw_tree_avx2 : draw_tree_baseline)(kernel, tree);
}

void DepthScan::draw(const std::vector<b2Fixture*>& solids, RayMasks masks) {
  if (solids.empty() || fan_.count() == 0) return;
  b2Transform world;
  world.SetIdentity();
  const DepthScanKernel kernel{
      *this, fan_, pose_.p, pose_.q.c, -pose_.q.s, angle_margin(fan_, pose_, world), masks};
  (has_avx2() ? draw_solids_avx2 : draw_solids_baseline)(kernel, solids);
}

}  // namespace flatland
