// Finds the rays that bounding boxes cover, eight boxes at a time, and traverses trees of boxes; a
// part of depth_kernel.h.

#include "rays/ray_kernel.h"

template <bool kFindsFixtures>
struct BoxKernel : RayKernel<kFindsFixtures> {
  using Base = RayKernel<kFindsFixtures>;
  using Base::frame;
  using Base::hits;
  using Base::is_visible;
  using Base::magnitude;
  using Base::scan;
  using typename Base::Floats;
  using typename Base::Mask;

  FLATLAND_INLINE simd::Floats angle_in_sensor(simd::Floats x, simd::Floats y) const {
    return simd::diamond_angle(frame.cos_to_sensor * x - frame.sin_to_sensor * y,
                               frame.sin_to_sensor * x + frame.cos_to_sensor * y);
  }

  // Half-open ranges of rays, which begin within the full circle and may extend beyond.
  struct Rays {
    simd::Ints begin, end;
  };

  // Returns the rays between two angles, or all rays in the lanes in which `is_all` is set.
  FLATLAND_INLINE Rays find_rays(simd::Floats low, simd::Floats high, simd::Ints is_all) const {
    const float cells_per_unit = static_cast<float>(1 << scan.cell_bits) / 4.0F;
    // An angle is NaN if a point coincides with the origin; `is_all` is set in these lanes.
    const simd::Floats zero = simd::broadcast(0.0F);
    const simd::Ints first = simd::floor(is_all ? zero : (low - frame.margin) * cells_per_unit);
    const simd::Ints last = simd::floor(is_all ? zero : (high + frame.margin) * cells_per_unit) + 1;
    const simd::Ints begin = first_rays(first);
    const simd::Ints end = first_rays(last);
    is_all |= end - begin >= scan.count;
    const simd::Ints turn = begin < 0
                                ? simd::Ints{} + scan.count
                                : (begin >= scan.count ? simd::Ints{} - scan.count : simd::Ints{});
    const Rays rays{is_all ? simd::Ints{} : begin + turn,
                    is_all ? simd::Ints{} + scan.count : end + turn};
    if constexpr (kFindsFixtures) {
      if (scan.drawn.end - scan.drawn.begin < scan.count) return drawn_part(rays);
    }
    return rays;
  }

  // Returns the parts of ranges that contain the rays to be drawn.
  FLATLAND_INLINE Rays drawn_part(Rays rays) const {
    const simd::Ints from = simd::Ints{} + scan.drawn.begin, to = simd::Ints{} + scan.drawn.end;
    Rays part{to, from};
    // A range may contain the same rays one turn earlier or later.
    for (std::int32_t turn = -scan.count; turn <= scan.count; turn += scan.count) {
      const simd::Ints begin = simd::max(rays.begin + turn, from);
      const simd::Ints end = simd::min(rays.end + turn, to);
      const simd::Ints is_some = begin < end;
      part.begin = is_some ? simd::min(part.begin, begin) : part.begin;
      part.end = is_some ? simd::max(part.end, end) : part.end;
    }
    part.end = simd::max(part.begin, part.end);
    const simd::Ints turn = (part.begin >= scan.count) & scan.count;
    return {part.begin - turn, part.end - turn};
  }

  // Returns the first rays at or after the starts of cells; see BeamFan.
  FLATLAND_INLINE simd::Ints first_rays(simd::Ints cell) const {
    std::int32_t index[simd::kWidth], first[simd::kWidth];
    simd::store(index, cell & ((1 << scan.cell_bits) - 1));
    for (std::size_t i = 0; i < simd::kWidth; ++i) first[i] = scan.first_in_cell[index[i]];
    return simd::load(first) + (cell >> scan.cell_bits) * scan.count;
  }

  // Finds the rays that boxes cover, and lower bounds of the distances of the boxes, for the boxes
  // whose bits are set in `set`.
  FLATLAND_INLINE void find_boxes(const float* min_x, const float* min_y, const float* max_x,
                                  const float* max_y, std::uint32_t set, Candidates& out) const {
    const simd::Floats x0 = simd::load(min_x) - frame.origin.x;
    const simd::Floats x1 = simd::load(max_x) - frame.origin.x;
    const simd::Floats y0 = simd::load(min_y) - frame.origin.y;
    const simd::Floats y1 = simd::load(max_y) - frame.origin.y;
    const simd::Floats zero = simd::broadcast(0.0F);
    const simd::Floats outside_x = simd::max(simd::max(x0, -x1), zero);
    const simd::Floats outside_y = simd::max(simd::max(y0, -y1), zero);
    const simd::Floats distance = simd::sqrt(outside_x * outside_x + outside_y * outside_y);
    simd::store(out.distance, distance * kBoxRounding);
    out.set = set;
    if constexpr (kFindsFixtures) {
      const simd::Floats height = simd::max(x0 * hits->front.x, x1 * hits->front.x) +
                                  simd::max(y0 * hits->front.y, y1 * hits->front.y);
      out.set &= ~Lanes::bits(height < hits->front_distance);  // a box that is not finite remains
      if (scan.first_in_cell == nullptr) {
        find_in_bundle(x0, y0, x1, y1, out);
        return;
      }
    }
    const simd::Floats size = (x1 - x0) + (y1 - y0);

    // The silhouette of a box consists of two corners, the rightmost and the leftmost corner as
    // seen from the origin.
    const simd::Ints is_right = x0 > 0.0F, is_left = x1 < 0.0F;
    const simd::Ints is_above = y0 > 0.0F, is_below = y1 < 0.0F;
    const simd::Floats near_x = is_right ? x0 : x1;
    const simd::Floats near_y = is_above ? y0 : y1;
    const simd::Floats low_x = is_above ? x1 : (is_below ? x0 : near_x);
    const simd::Floats high_x = is_above ? x0 : (is_below ? x1 : near_x);
    const simd::Floats low_y = is_right ? y0 : (is_left ? y1 : near_y);
    const simd::Floats high_y = is_right ? y1 : (is_left ? y0 : near_y);
    const simd::Floats from = angle_in_sensor(low_x, low_y);
    const simd::Floats turn = simd::wrap_difference(angle_in_sensor(high_x, high_y) - from);
    const simd::Ints is_near = distance <= kNearTolerance * size;
    // The comparison with NaN is false.
    const simd::Ints is_partial = simd::abs(turn) <= 2.0F - kNearTolerance;
    const Rays rays = find_rays(from + simd::min(turn, zero), from + simd::max(turn, zero),
                                is_near | ~is_partial);
    simd::store(out.begin, rays.begin);
    simd::store(out.end, rays.end);
  }

  // Finds the boxes, relative to the origin, that at least one ray of a bundle may hit.
  FLATLAND_INLINE void find_in_bundle(simd::Floats x0, simd::Floats y0, simd::Floats x1,
                                      simd::Floats y1, Candidates& out) const {
    const simd::Floats center_x = (x0 + x1) * 0.5F, center_y = (y0 + y1) * 0.5F;
    const simd::Floats half_x = (x1 - x0) * 0.5F, half_y = (y1 - y0) * 0.5F;
    float x[simd::kWidth], y[simd::kWidth], w[simd::kWidth], h[simd::kWidth];
    simd::store(x, center_x);
    simd::store(y, center_y);
    simd::store(w, half_x + (simd::abs(center_x) + half_x) * kBundleTolerance);
    simd::store(h, half_y + (simd::abs(center_y) + half_y) * kBundleTolerance);
    simd::store(out.begin, simd::Ints{});
    simd::store(out.end, simd::Ints{} + scan.count);
    const std::uint32_t possible = out.set;
    out.set = 0;
    const Floats zero = Lanes::broadcast(0.0F);
    for (std::uint32_t set = possible; set != 0; set &= set - 1) {
      const int i = __builtin_ctz(set);
      const Floats least =
          Lanes::broadcast(out.distance[i] * kCircleRounding * scan.fraction_per_metre);
      Mask is_hit = Lanes::none();
      for (std::int32_t first = 0; first < kBundle; first += Lanes::kWidth) {
        const Floats d_x = Lanes::load(scan.d_x + first), d_y = Lanes::load(scan.d_y + first);
        const Floats size_x = magnitude(d_x), size_y = magnitude(d_y);
        const Floats reach = size_x * h[i] + size_y * w[i];
        const Floats end = (d_x * x[i] + d_y * y[i]) + (size_x * w[i] + size_y * h[i]);
        const Floats side = magnitude(d_x * y[i] - d_y * x[i]);
        const Floats fraction = Lanes::load(scan.fraction + first);
        const Mask is_beside = Lanes::either(Lanes::less(reach, side), Lanes::less(end, zero));
        const Mask is_missed = Lanes::either(is_beside, Lanes::less(fraction, least));
        // The comparisons are written so that boxes that are not finite are found.
        is_hit =
            Lanes::either(is_hit, Lanes::but_not(Lanes::less_equal(zero, fraction), is_missed));
      }
      out.set |= static_cast<std::uint32_t>(Lanes::any(is_hit)) << i;
    }
  }

  // Calls draw_leaf(index, rays) for the visible leaves of a tree, approximately from front to
  // back. Distances of boxes are multiplied by `rounding`.
  template <typename DrawLeaf>
  FLATLAND_INLINE void traverse(const EdgeTree::Node* nodes, float rounding,
                                DrawLeaf&& draw_leaf) const {
    StackEntry stack[EdgeTree::kMaxDepth * EdgeTree::kFanOut];
    std::size_t size = 0;
    stack[size++] = {0.0F, scan.drawn, 0};
    while (size > 0) {
      const StackEntry next = stack[--size];
      if (!is_visible(next.rays, next.distance)) continue;
      if ((next.child & EdgeTree::kLeafBit) != 0) {
        draw_leaf(next.child & ~EdgeTree::kLeafBit, next.rays);
        continue;
      }
      const EdgeTree::Node& node = nodes[next.child];
      Candidates found;
      find_boxes(node.min_x, node.min_y, node.max_x, node.max_y, (1U << node.count) - 1U, found);
      const std::size_t first = size;
      for (std::uint32_t set = found.set; set != 0; set &= set - 1) {
        const int i = __builtin_ctz(set);
        const Interval rays{found.begin[i], found.end[i]};
        const float distance = found.distance[i] * rounding;
        if (!frame.masks.pass(node.category_bits[i]) || !is_visible(rays, distance)) continue;
        // Insertion sort, with the nearest entry on top of the stack.
        std::size_t top = size++;
        for (; top > first && stack[top - 1].distance < distance; --top) {
          stack[top] = stack[top - 1];
        }
        stack[top] = {distance, rays, node.child[i]};
      }
    }
  }
};
