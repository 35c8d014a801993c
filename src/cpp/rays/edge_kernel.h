// Draws edges, eight at a time; a part of depth_kernel.h.

template <bool kFindsFixtures>
struct EdgeKernel : BoxKernel<kFindsFixtures> {
  using Base = BoxKernel<kFindsFixtures>;
  using Base::angle_in_sensor;
  using Base::any_of;
  using Base::apply_fate;
  using Base::find_rays;
  using Base::frame;
  using Base::hits;
  using Base::least_fraction;
  using Base::magnitude;
  using Base::reflects;
  using Base::scan;
  using typename Base::Floats;
  using typename Base::Mask;
  using typename Base::Rays;

  // The ends of eight edges relative to the origin of the rays, and the numerators of the
  // fractions.
  struct Edges {
    float a_x[simd::kWidth], a_y[simd::kWidth], b_x[simd::kWidth], b_y[simd::kWidth];
    float numerator[simd::kWidth];
    // The members below are used only with kFindsFixtures.
    std::uint32_t fixture[simd::kWidth];
    float reflectance[simd::kWidth];
    const std::uint16_t* material;
  };

  // Draws the edges whose bits are set in `set` into a vector of rays. kIsEdgeOn: see
  // `find_edge_on`. kHasFate: edges may let rays pass, or reflect rays.
  template <bool kIsEdgeOn, bool kHasFate>
  FLATLAND_INLINE void draw_edges(const EdgeTree::Leaf& leaf, const Edges& edges, std::uint32_t set,
                                  std::int32_t first) const {
    const Floats zero = Lanes::broadcast(0.0F);
    const Floats miss = Lanes::broadcast(kMissFraction);
    const Floats d_x = Lanes::load(scan.d_x + first);
    const Floats d_y = Lanes::load(scan.d_y + first);
    Floats nearest = Lanes::load(scan.fraction + first);
    Floats fixture = nearest;
    Floats brightness = nearest;
    Floats least = zero;
    if constexpr (kFindsFixtures) {
      fixture = Lanes::load(hits->fixture + first);
      brightness = Lanes::load(hits->brightness + first);
      least = least_fraction(first);
    }
    for (; set != 0; set &= set - 1) {
      const int i = __builtin_ctz(set);
      const Floats side_a = d_x * edges.a_y[i] - d_y * edges.a_x[i];
      const Floats side_b = d_x * edges.b_y[i] - d_y * edges.b_x[i];
      const Mask is_crossed = Lanes::both(Lanes::less_equal(Lanes::min(side_a, side_b), zero),
                                          Lanes::less_equal(zero, Lanes::max(side_a, side_b)));
      if constexpr (kFindsFixtures) {
        // After a reflection only few rays remain, and most edges of a leaf cross none of them.
        if (!Lanes::any(is_crossed)) continue;
      }
      const Floats denominator = leaf.normal_x[i] * d_x + leaf.normal_y[i] * d_y;
      Floats fraction = edges.numerator[i] / denominator;
      if constexpr (kIsEdgeOn) {
        const Floats dd = d_x * d_x + d_y * d_y;
        const Floats at_a = (d_x * edges.a_x[i] + d_y * edges.a_y[i]) / dd;
        const Floats at_b = (d_x * edges.b_x[i] + d_y * edges.b_y[i]) / dd;
        fraction = Lanes::min(Lanes::max(fraction, Lanes::min(at_a, at_b)), Lanes::max(at_a, at_b));
      }
      // A fraction of NaN is a miss.
      const Mask is_ahead =
          Lanes::both(Lanes::not_equal(denominator, zero), Lanes::less_equal(least, fraction));
      if constexpr (kFindsFixtures) {
        Mask is_new =
            Lanes::both(Lanes::both(is_crossed, is_ahead), Lanes::less(fraction, nearest));
        Floats shade = magnitude(denominator) * edges.reflectance[i];
        if constexpr (kHasFate) {
          apply_fate(first, {edges.fixture[i], hits->optics + edges.material[i]}, is_new, shade);
        }
        nearest = Lanes::select(is_new, fraction, nearest);
        fixture = Lanes::select(is_new, Lanes::as_floats(Lanes::words(edges.fixture[i])), fixture);
        brightness = Lanes::select(is_new, shade, brightness);
      } else {
        const Floats hit = Lanes::select(Lanes::both(is_crossed, is_ahead), fraction, miss);
        nearest = Lanes::min(hit, nearest);
      }
    }
    Lanes::store(scan.fraction + first, nearest);
    if constexpr (kFindsFixtures) {
      Lanes::store(hits->fixture + first, fixture);
      Lanes::store(hits->brightness + first, brightness);
    }
  }

  // Returns the edges whose lines pass through the origin of the rays, within the rounding errors.
  // The fraction of a ray along such a line is a quotient of two rounding errors, and rounding
  // decides whether the ray crosses the edge. The fraction is therefore limited to those of the
  // ends of the edge, so that no ray has a hit beside the edge.
  FLATLAND_INLINE std::uint32_t find_edge_on(simd::Floats a_x, simd::Floats a_y, simd::Floats b_x,
                                             simd::Floats b_y, simd::Floats numerator) const {
    const simd::Floats size = (simd::abs(a_x) + simd::abs(a_y)) + (simd::abs(b_x) + simd::abs(b_y));
    return Lanes::bits(simd::abs(numerator) <= kEdgeOn * size);
  }

  // Draws the edges of a leaf. `leaf_rays` contains all rays that may cross the edges; `fixtures`
  // is null without kFindsFixtures.
  FLATLAND_INLINE void draw_leaf(const EdgeTree::Leaf& leaf, const EdgeTree::LeafFixtures* fixtures,
                                 Interval leaf_rays) const {
    const simd::Floats a_x = simd::load(leaf.x1) - frame.origin.x;
    const simd::Floats a_y = simd::load(leaf.y1) - frame.origin.y;
    const simd::Floats b_x = simd::load(leaf.x2) - frame.origin.x;
    const simd::Floats b_y = simd::load(leaf.y2) - frame.origin.y;
    Edges edges;
    simd::store(edges.a_x, a_x);
    simd::store(edges.a_y, a_y);
    simd::store(edges.b_x, b_x);
    simd::store(edges.b_y, b_y);
    const simd::Floats numerator =
        simd::load(leaf.normal_x) * a_x + simd::load(leaf.normal_y) * a_y;
    simd::store(edges.numerator, numerator);
    std::uint32_t wanted = wanted_edges(leaf);
    bool has_fate = false;
    if constexpr (kFindsFixtures) {
      simd::Ints fixture = simd::load(fixtures->fixture);
      if (fixtures->has_coincident) {
        fixture = is_second(leaf) ? simd::load(fixtures->coincident) : fixture;
      }
      simd::store(edges.fixture, fixture);
      wanted &= ~Lanes::bits(fixture == static_cast<std::int32_t>(hits->excluded));
      edges.material = hits->uses_materials ? fixtures->material : kNoMaterial;
      simd::store(edges.reflectance, simd::broadcast(hits->optics->reflectance));
      for (std::uint32_t i = 0; fixtures->has_materials && i < leaf.count; ++i) {
        const Optics& optics = hits->optics[edges.material[i]];
        edges.reflectance[i] = optics.reflectance;
        has_fate = has_fate || optics.pass_limit != Optics::kOpaque || reflects(optics);
        const bool is_invisible = optics.pass_limit == Optics::kInvisible;
        wanted &= ~(static_cast<std::uint32_t>(is_invisible) << i);
      }
    }
    const std::uint32_t edge_on = wanted & find_edge_on(a_x, a_y, b_x, b_y, numerator);
    if (edge_on != 0) {
      any_of(leaf_rays, [&](std::int32_t first, std::int32_t, std::int32_t) {
        draw_edges<true, true>(leaf, edges, edge_on, first);
        return false;
      });
      wanted &= ~edge_on;
    }
    if (has_fate) {
      draw_covered<true>(leaf, edges, wanted, leaf_rays);
    } else {
      draw_covered<false>(leaf, edges, wanted, leaf_rays);
    }
  }

  // Draws the edges of a set into the rays that they cover.
  template <bool kHasFate>
  FLATLAND_INLINE void draw_covered(const EdgeTree::Leaf& leaf, const Edges& edges,
                                    std::uint32_t wanted, Interval leaf_rays) const {
    if (leaf_rays.end - (leaf_rays.begin & -Lanes::kWidth) <= kFewVectors * Lanes::kWidth) {
      any_of(leaf_rays, [&](std::int32_t first, std::int32_t, std::int32_t) {
        draw_edges<false, kHasFate>(leaf, edges, wanted, first);
        return false;
      });
      return;
    }
    const simd::Floats a_x = simd::load(edges.a_x), a_y = simd::load(edges.a_y);
    const simd::Floats b_x = simd::load(edges.b_x), b_y = simd::load(edges.b_y);
    const simd::Floats from = angle_in_sensor(a_x, a_y);
    const simd::Floats turn = simd::wrap_difference(angle_in_sensor(b_x, b_y) - from);
    const simd::Floats zero = simd::broadcast(0.0F);
    const simd::Ints is_partial = simd::abs(turn) < 2.0F - kNearTolerance;
    Rays rays = find_rays(from + simd::min(turn, zero), from + simd::max(turn, zero), ~is_partial);
    draw_runs<kHasFate>(leaf, edges, wanted, {rays.begin, simd::min(rays.end, scan.count)});
    if ((Lanes::bits(rays.end > scan.count) & wanted) == 0) return;
    draw_runs<kHasFate>(leaf, edges, wanted, {simd::Ints{}, rays.end - scan.count});
  }

  // Returns the edges that stop rays.
  FLATLAND_INLINE std::uint32_t wanted_edges(const EdgeTree::Leaf& leaf) const {
    if (frame.masks.pass(leaf.common_bits)) return (1U << leaf.count) - 1U;
    std::uint32_t wanted = 0;
    for (std::uint32_t i = 0; i < leaf.count; ++i) {
      const bool passes =
          frame.masks.pass(leaf.category_bits[i]) || frame.masks.pass(leaf.coincident_bits[i]);
      wanted |= static_cast<std::uint32_t>(passes) << i;
    }
    return wanted;
  }

  // Returns whether rays hit the second of two coincident edges: the second edge stops rays, and
  // either the first edge does not, or the second edge has a preferred category.
  FLATLAND_INLINE simd::Ints is_second(const EdgeTree::Leaf& leaf) const {
    const simd::Ints bits = simd::load(leaf.coincident_bits);
    return pass(bits) & (~pass(simd::load(leaf.category_bits)) | ((bits & hits->preferred) != 0));
  }

  // Returns whether edges with these category bits stop rays.
  FLATLAND_INLINE simd::Ints pass(simd::Ints category_bits) const {
    return ((category_bits & frame.masks.stop) != 0) & ((category_bits & frame.masks.select) != 0);
  }

  // Draws the edges of a set into ranges of rays that do not extend beyond the full circle.
  template <bool kHasFate>
  FLATLAND_INLINE void draw_runs(const EdgeTree::Leaf& leaf, const Edges& edges,
                                 std::uint32_t wanted, Rays rays) const {
    const simd::Ints is_empty = rays.begin >= rays.end;
    wanted &= ~Lanes::bits(is_empty);
    const std::int32_t begin = simd::lowest(is_empty ? simd::Ints{} + scan.count : rays.begin);
    const std::int32_t end = simd::highest(is_empty ? simd::Ints{} : rays.end);
    for (std::int32_t first = begin & -Lanes::kWidth; first < end; first += Lanes::kWidth) {
      const std::uint32_t set =
          wanted & Lanes::bits((rays.begin < first + Lanes::kWidth) & (rays.end > first));
      if (set != 0) draw_edges<false, kHasFate>(leaf, edges, set, first);
    }
  }
};
