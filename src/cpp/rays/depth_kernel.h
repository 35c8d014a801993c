// The inner loops of depth_scan.cpp, which includes this file once for each instruction set, in a
// namespace with a type `Lanes` (see simd.h). All functions are inlined into `draw_tree` and
// `draw_solids`. Function templates of other headers must not be used: the linker could choose a
// copy compiled for an instruction set that the processor lacks.

//
// With kFindsFixtures, the kernel also records which fixture each ray hits, and fixtures may let
// rays pass (see HitRules). Of several fixtures at the same distance, one is recorded that depends
// neither on the instruction set nor on other scans: edges are always drawn in the same order, and
// circles and polygons replace fixtures with higher slots.

template <bool kFindsFixtures>
struct Kernel {
  using Floats = Lanes::Floats;
  using Words = Lanes::Words;
  using Mask = Lanes::Mask;

  const ScanView& scan;
  const ScanFrame& frame;
  const HitView* hits;  // null without kFindsFixtures

  // A fixture to be drawn, used only with kFindsFixtures.
  struct Object {
    std::uint32_t fixture, pass_limit;
  };

  // -- rays and their hits -----------------------------------------------------------------------

  // Calls visit(first, begin, end) for consecutive aligned vectors of rays that together contain
  // the interval, until visit returns true. `first` is the first ray of a vector; the rays from
  // `begin` to `end` - 1 belong to the interval. Returns whether a call returned true.
  template <typename Visit>
  FLATLAND_INLINE bool any_of(Interval rays, Visit&& visit) const {
    const std::int32_t count = scan.count;
    const std::int32_t end = rays.end < count ? rays.end : count;
    for (std::int32_t first = rays.begin & -Lanes::kWidth; first < end; first += Lanes::kWidth) {
      if (visit(first, rays.begin, end)) return true;
    }
    for (std::int32_t first = 0; first < rays.end - count; first += Lanes::kWidth) {
      if (visit(first, 0, rays.end - count)) return true;
    }
    return false;
  }

  // Whether one of the rays reaches a distance.
  FLATLAND_INLINE bool is_visible(Interval rays, float distance) const {
    const Floats least = Lanes::broadcast(distance * scan.fraction_per_metre);
    return any_of(rays, [&](std::int32_t first, std::int32_t begin, std::int32_t end) {
      return Lanes::any(Lanes::both(Lanes::less_equal(least, Lanes::load(scan.fraction + first)),
                                    Lanes::range(begin - first, end - first)));
    });
  }

  // Records the hits of a vector of rays that are nearer than their previous ones; NaN is a miss.
  FLATLAND_INLINE void record_hits(std::int32_t first, Floats fraction, Mask is_hit,
                                   const Object& object) const {
    const Floats before = Lanes::load(scan.fraction + first);
    if constexpr (kFindsFixtures) {
      Floats fixture = Lanes::load(hits->fixture + first);
      const Mask is_ahead = Lanes::less_equal(least_fraction(first), fraction);
      const Mask is_first = Lanes::less(Lanes::words(object.fixture), Lanes::as_words(fixture));
      const Mask is_nearer = Lanes::either(Lanes::less(fraction, before),
                                           Lanes::both(Lanes::equal(fraction, before), is_first));
      const Mask is_new =
          stopped(first, Lanes::both(Lanes::both(is_hit, is_ahead), is_nearer), object);
      if (!Lanes::any(is_new)) return;
      Lanes::store(scan.fraction + first, Lanes::select(is_new, fraction, before));
      fixture = Lanes::select(is_new, Lanes::as_floats(Lanes::words(object.fixture)), fixture);
      Lanes::store(hits->fixture + first, fixture);
    } else {
      const Mask is_nearer = Lanes::both(Lanes::less_equal(Lanes::broadcast(0.0F), fraction),
                                         Lanes::less(fraction, before));
      Lanes::store(scan.fraction + first,
                   Lanes::select(Lanes::both(is_hit, is_nearer), fraction, before));
    }
  }

  // The least fraction of a hit of a vector of rays.
  FLATLAND_INLINE Floats least_fraction(std::int32_t first) const {
    if (hits->nearest == nullptr) return Lanes::broadcast(0.0F);
    return Lanes::load(hits->nearest + first);
  }

  // Returns which rays of a vector an object stops.
  FLATLAND_INLINE Mask stopped(std::int32_t first, Mask is_hit, const Object& object) const {
    if (object.pass_limit == Materials::kOpaque || !Lanes::any(is_hit)) return is_hit;
    const auto* words = reinterpret_cast<const float*>(hits->words);
    const Words fate =
        fate_word(Lanes::as_words(Lanes::load(words + first)), hits->leg ^ object.fixture);
    return Lanes::but_not(is_hit, Lanes::less(fate, Lanes::words(object.pass_limit)));
  }

  // Returns a fixture as an object, which is invisible if rays do not end at it.
  FLATLAND_INLINE Object object_of(std::uint32_t fixture) const {
    if (fixture == hits->excluded) return {fixture, Materials::kInvisible};
    const std::uint16_t number = fixture < hits->count ? hits->number[fixture] : std::uint16_t{0};
    return {fixture, hits->pass_limit[number]};
  }

  // End points of a vector of rays in the world frame.
  FLATLAND_INLINE void load_ends(std::int32_t first, Floats& x, Floats& y) const {
    const b2Transform& pose = scan.pose;
    const Floats fan_x = Lanes::load(scan.fan_x + first);
    const Floats fan_y = Lanes::load(scan.fan_y + first);
    x = (pose.q.c * fan_x - pose.q.s * fan_y) + pose.p.x;
    y = (pose.q.s * fan_x + pose.q.c * fan_y) + pose.p.y;
  }

  // Computes the vectors along the rays in the frame of a body.
  FLATLAND_INLINE void set_frame(const b2Transform& body) const {
    const std::int32_t begin = scan.drawn.begin & -Lanes::kWidth;
    for (std::int32_t first = begin; first < scan.drawn.end; first += Lanes::kWidth) {
      Floats x, y;
      load_ends(first, x, y);
      x = x - body.p.x;
      y = y - body.p.y;
      Lanes::store(scan.d_x + first, (body.q.c * x + body.q.s * y) - frame.origin.x);
      Lanes::store(scan.d_y + first, (-body.q.s * x + body.q.c * y) - frame.origin.y);
    }
  }

  // -- eight boxes or edges at a time ------------------------------------------------------------

  FLATLAND_INLINE simd::Floats angle_in_sensor(simd::Floats x, simd::Floats y) const {
    return simd::diamond_angle(frame.cos_to_sensor * x - frame.sin_to_sensor * y,
                               frame.sin_to_sensor * x + frame.cos_to_sensor * y);
  }

  // Half-open ranges of rays. They begin within the full circle and may extend beyond it.
  struct Rays {
    simd::Ints begin, end;
  };

  // Finds the rays between two angles, or all rays where `is_all`.
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
    return {is_all ? simd::Ints{} : begin + turn, is_all ? simd::Ints{} + scan.count : end + turn};
  }

  // The first rays at or after the starts of cells; see BeamFan.
  FLATLAND_INLINE simd::Ints first_rays(simd::Ints cell) const {
    std::int32_t index[simd::kWidth], first[simd::kWidth];
    simd::store(index, cell & ((1 << scan.cell_bits) - 1));
    for (std::size_t i = 0; i < simd::kWidth; ++i) first[i] = scan.first_in_cell[index[i]];
    return simd::load(first) + (cell >> scan.cell_bits) * scan.count;
  }

  // Finds the rays covered by eight boxes, and the distances of the boxes.
  FLATLAND_INLINE void find_boxes(const float* min_x, const float* min_y, const float* max_x,
                                  const float* max_y, Candidates& out) const {
    const simd::Floats x0 = simd::load(min_x) - frame.origin.x;
    const simd::Floats x1 = simd::load(max_x) - frame.origin.x;
    const simd::Floats y0 = simd::load(min_y) - frame.origin.y;
    const simd::Floats y1 = simd::load(max_y) - frame.origin.y;
    const simd::Floats zero = simd::broadcast(0.0F);
    const simd::Floats outside_x = simd::max(simd::max(x0, -x1), zero);
    const simd::Floats outside_y = simd::max(simd::max(y0, -y1), zero);
    const simd::Floats distance = simd::sqrt(outside_x * outside_x + outside_y * outside_y);
    const simd::Floats size = (x1 - x0) + (y1 - y0);

    // The silhouette of a box consists of two of its corners, its rightmost and its leftmost one
    // when viewed from the origin.
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
    // False for NaN.
    const simd::Ints is_partial = simd::abs(turn) <= 2.0F - kNearTolerance;
    const Rays rays = find_rays(from + simd::min(turn, zero), from + simd::max(turn, zero),
                                is_near | ~is_partial);
    simd::store(out.begin, rays.begin);
    simd::store(out.end, rays.end);
    simd::store(out.distance, distance * kBoxRounding);
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
      find_boxes(node.min_x, node.min_y, node.max_x, node.max_y, found);
      const std::size_t first = size;
      for (std::uint32_t i = 0; i < node.count; ++i) {
        const Interval rays{found.begin[i], found.end[i]};
        const float distance = found.distance[i] * rounding;
        if (!frame.masks.pass(node.category_bits[i]) || !is_visible(rays, distance)) continue;
        if constexpr (kFindsFixtures) {
          if (is_before(node, i)) continue;
        }
        // Insertion sort, with the nearest entry on top of the stack.
        std::size_t top = size++;
        for (; top > first && stack[top - 1].distance < distance; --top) {
          stack[top] = stack[top - 1];
        }
        stack[top] = {distance, rays, node.child[i]};
      }
    }
  }

  // Whether a box is nearer than the least distance of all hits.
  FLATLAND_INLINE bool is_before(const EdgeTree::Node& node, std::uint32_t i) const {
    const float x0 = node.min_x[i] - frame.origin.x, x1 = node.max_x[i] - frame.origin.x;
    const float y0 = node.min_y[i] - frame.origin.y, y1 = node.max_y[i] - frame.origin.y;
    const float xx = x0 * x0 > x1 * x1 ? x0 * x0 : x1 * x1;
    const float yy = y0 * y0 > y1 * y1 ? y0 * y0 : y1 * y1;
    return xx + yy < hits->least_distance * hits->least_distance;
  }

  // -- edges -------------------------------------------------------------------------------------

  // The ends of eight edges relative to the origin of the rays, and the numerators of fractions.
  struct Edges {
    float a_x[simd::kWidth], a_y[simd::kWidth], b_x[simd::kWidth], b_y[simd::kWidth];
    float numerator[simd::kWidth];
  };

  // Draws the edges of a set, given by its bits, into a vector of rays. For edges seen edge-on, see
  // `find_edge_on`.
  template <bool kIsEdgeOn>
  FLATLAND_INLINE void draw_edges(const EdgeTree::Leaf& leaf, const Edges& edges, std::uint32_t set,
                                  std::int32_t first, const Object* objects) const {
    const Floats zero = Lanes::broadcast(0.0F);
    const Floats miss = Lanes::broadcast(kMissFraction);
    const Floats d_x = Lanes::load(scan.d_x + first);
    const Floats d_y = Lanes::load(scan.d_y + first);
    Floats nearest = Lanes::load(scan.fraction + first);
    Floats fixture = nearest;
    Floats least = zero;
    if constexpr (kFindsFixtures) {
      fixture = Lanes::load(hits->fixture + first);
      least = least_fraction(first);
    }
    for (; set != 0; set &= set - 1) {
      const int i = __builtin_ctz(set);
      const Floats side_a = d_x * edges.a_y[i] - d_y * edges.a_x[i];
      const Floats side_b = d_x * edges.b_y[i] - d_y * edges.b_x[i];
      const Floats denominator = leaf.normal_x[i] * d_x + leaf.normal_y[i] * d_y;
      Floats fraction = edges.numerator[i] / denominator;
      if constexpr (kIsEdgeOn) {
        const Floats dd = d_x * d_x + d_y * d_y;
        const Floats at_a = (d_x * edges.a_x[i] + d_y * edges.a_y[i]) / dd;
        const Floats at_b = (d_x * edges.b_x[i] + d_y * edges.b_y[i]) / dd;
        fraction = Lanes::min(Lanes::max(fraction, Lanes::min(at_a, at_b)), Lanes::max(at_a, at_b));
      }
      const Mask is_crossed = Lanes::both(Lanes::less_equal(Lanes::min(side_a, side_b), zero),
                                          Lanes::less_equal(zero, Lanes::max(side_a, side_b)));
      // A fraction of NaN is a miss.
      const Mask is_ahead =
          Lanes::both(Lanes::not_equal(denominator, zero), Lanes::less_equal(least, fraction));
      if constexpr (kFindsFixtures) {
        const Object& object = objects[i];
        const Mask is_hit = Lanes::both(is_crossed, is_ahead);
        const Mask is_new =
            stopped(first, Lanes::both(is_hit, Lanes::less(fraction, nearest)), object);
        nearest = Lanes::select(is_new, fraction, nearest);
        fixture = Lanes::select(is_new, Lanes::as_floats(Lanes::words(object.fixture)), fixture);
      } else {
        const Floats hit = Lanes::select(Lanes::both(is_crossed, is_ahead), fraction, miss);
        nearest = Lanes::min(hit, nearest);
      }
    }
    Lanes::store(scan.fraction + first, nearest);
    if constexpr (kFindsFixtures) Lanes::store(hits->fixture + first, fixture);
  }

  // Finds the edges whose lines pass through the origin of the rays, within the rounding errors.
  // The fraction of a ray along such a line is a quotient of two rounding errors, and rounding
  // decides whether the ray crosses the edge. The fraction is therefore limited to those of the
  // ends of the edge, so that no ray has a hit beside the edge.
  FLATLAND_INLINE std::uint32_t find_edge_on(simd::Floats a_x, simd::Floats a_y, simd::Floats b_x,
                                             simd::Floats b_y, simd::Floats numerator) const {
    const simd::Floats size = (simd::abs(a_x) + simd::abs(a_y)) + (simd::abs(b_x) + simd::abs(b_y));
    return Lanes::bits(simd::abs(numerator) <= kEdgeOn * size);
  }

  // Draws the edges of a leaf; `rays` covers all of them. The fixtures are null without
  // kFindsFixtures.
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
    std::uint32_t wanted = 0;
    for (std::uint32_t i = 0; i < leaf.count; ++i) {
      const bool passes =
          frame.masks.pass(leaf.category_bits[i]) || frame.masks.pass(leaf.coincident_bits[i]);
      wanted |= static_cast<std::uint32_t>(passes) << i;
    }
    Object objects[EdgeTree::kFanOut];
    if constexpr (kFindsFixtures) {
      for (std::uint32_t i = 0; i < leaf.count; ++i) {
        objects[i] = object_of(is_second(leaf, i) ? fixtures->coincident[i] : fixtures->fixture[i]);
        if (objects[i].pass_limit == Materials::kInvisible) wanted &= ~(1U << i);
      }
    }
    const std::uint32_t edge_on = wanted & find_edge_on(a_x, a_y, b_x, b_y, numerator);
    if (edge_on != 0) {
      any_of(leaf_rays, [&](std::int32_t first, std::int32_t, std::int32_t) {
        draw_edges<true>(leaf, edges, edge_on, first, objects);
        return false;
      });
      wanted &= ~edge_on;
    }
    if (leaf_rays.end - (leaf_rays.begin & -Lanes::kWidth) <= kFewVectors * Lanes::kWidth) {
      any_of(leaf_rays, [&](std::int32_t first, std::int32_t, std::int32_t) {
        draw_edges<false>(leaf, edges, wanted, first, objects);
        return false;
      });
      return;
    }
    const simd::Floats from = angle_in_sensor(a_x, a_y);
    const simd::Floats turn = simd::wrap_difference(angle_in_sensor(b_x, b_y) - from);
    const simd::Floats zero = simd::broadcast(0.0F);
    const simd::Ints is_partial = simd::abs(turn) < 2.0F - kNearTolerance;
    Rays rays = find_rays(from + simd::min(turn, zero), from + simd::max(turn, zero), ~is_partial);
    draw_runs(leaf, edges, wanted, {rays.begin, simd::min(rays.end, scan.count)}, objects);
    if ((Lanes::bits(rays.end > scan.count) & wanted) == 0) return;
    draw_runs(leaf, edges, wanted, {simd::Ints{}, rays.end - scan.count}, objects);
  }

  // Whether the second of two coincident edges is the one that rays hit: it stops them and the
  // first one does not, or it has a preferred category.
  FLATLAND_INLINE bool is_second(const EdgeTree::Leaf& leaf, std::uint32_t i) const {
    if (!frame.masks.pass(leaf.coincident_bits[i])) return false;
    return !frame.masks.pass(leaf.category_bits[i]) ||
           (leaf.coincident_bits[i] & hits->preferred) != 0;
  }

  // Draws the edges of a set into the rays that they cover, which do not extend beyond the full
  // circle.
  FLATLAND_INLINE void draw_runs(const EdgeTree::Leaf& leaf, const Edges& edges,
                                 std::uint32_t wanted, Rays rays, const Object* objects) const {
    const simd::Ints is_empty = rays.begin >= rays.end;
    wanted &= ~Lanes::bits(is_empty);
    const std::int32_t begin = simd::lowest(is_empty ? simd::Ints{} + scan.count : rays.begin);
    const std::int32_t end = simd::highest(is_empty ? simd::Ints{} : rays.end);
    for (std::int32_t first = begin & -Lanes::kWidth; first < end; first += Lanes::kWidth) {
      const std::uint32_t set =
          wanted & Lanes::bits((rays.begin < first + Lanes::kWidth) & (rays.end > first));
      if (set != 0) draw_edges<false>(leaf, edges, set, first, objects);
    }
  }

  // -- circles and polygons ----------------------------------------------------------------------

  FLATLAND_INLINE void draw_circle(const b2CircleShape& circle, const b2Transform& body,
                                   Interval rays, const Object& object) const {
    const b2Vec2 position = body.p + b2Mul(body.q, circle.m_p);
    const b2Vec2 s = scan.pose.p - position;
    const float b = b2Dot(s, s) - circle.m_radius * circle.m_radius;
    // A ray that starts inside does not hit the circle. Near the outline, rounding decides.
    if (b < -kInside * circle.m_radius * circle.m_radius && b < -kInside * b2_epsilon) return;
    const Floats zero = Lanes::broadcast(0.0F);
    any_of(rays, [&](std::int32_t first, std::int32_t, std::int32_t) {
      Floats r_x, r_y;
      load_ends(first, r_x, r_y);
      r_x = r_x - scan.pose.p.x;
      r_y = r_y - scan.pose.p.y;
      const Floats c = s.x * r_x + s.y * r_y;
      const Floats rr = r_x * r_x + r_y * r_y;
      const Floats sigma = c * c - rr * b;
      const Floats root = Lanes::sqrt(Lanes::max(sigma, zero));
      const Floats a = -(c + root);
      const Mask is_hit = Lanes::both(Lanes::less_equal(zero, sigma),
                                      Lanes::less_equal(Lanes::broadcast(b2_epsilon), rr));
      record_hits(first, a / rr, Lanes::both(is_hit, Lanes::less_equal(a, rr)), object);
      return false;
    });
  }

  FLATLAND_INLINE void draw_polygon(const b2PolygonShape& polygon, const b2Transform& body,
                                    Interval rays, const Object& object) const {
    const b2Vec2 p1 = b2MulT(body.q, scan.pose.p - body.p);
    float numerators[b2_maxPolygonVertices];
    bool is_outside = false;
    for (int32 i = 0; i < polygon.m_count; ++i) {
      numerators[i] = b2Dot(polygon.m_normals[i], polygon.m_vertices[i] - p1);
      is_outside |= !(numerators[i] >= 0.0F);
    }
    // A ray that starts inside enters no half-plane.
    if (!is_outside) return;
    const Floats zero = Lanes::broadcast(0.0F);
    any_of(rays, [&](std::int32_t first, std::int32_t, std::int32_t) {
      Floats world_x, world_y;
      load_ends(first, world_x, world_y);
      world_x = world_x - body.p.x;
      world_y = world_y - body.p.y;
      const Floats d_x = (body.q.c * world_x + body.q.s * world_y) - p1.x;
      const Floats d_y = (-body.q.s * world_x + body.q.c * world_y) - p1.y;
      Floats lower = zero;
      Floats upper = Lanes::broadcast(1.0F);
      Mask enters = Lanes::none();
      Mask misses = Lanes::none();
      for (int32 i = 0; i < polygon.m_count; ++i) {
        const b2Vec2 normal = polygon.m_normals[i];
        const Floats numerator = Lanes::broadcast(numerators[i]);
        const Floats denominator = normal.x * d_x + normal.y * d_y;
        const Floats fraction = numerator / denominator;
        const Mask is_entry = Lanes::both(Lanes::less(denominator, zero),
                                          Lanes::less(numerator, lower * denominator));
        const Mask is_exit = Lanes::both(Lanes::less(zero, denominator),
                                         Lanes::less(numerator, upper * denominator));
        if (numerators[i] < 0.0F) misses = Lanes::either(misses, Lanes::equal(denominator, zero));
        lower = Lanes::select(is_entry, fraction, lower);
        upper = Lanes::select(is_exit, fraction, upper);
        enters = Lanes::either(enters, is_entry);
      }
      record_hits(first, lower,
                  Lanes::but_not(Lanes::both(enters, Lanes::less_equal(lower, upper)), misses),
                  object);
      return false;
    });
  }

  // Draws up to eight circles and polygons.
  FLATLAND_INLINE void draw_solids(b2Fixture* const* solids, std::size_t count) const {
    float min_x[simd::kWidth], min_y[simd::kWidth], max_x[simd::kWidth], max_y[simd::kWidth];
    for (std::size_t i = 0; i < simd::kWidth; ++i) {
      const b2AABB& box = solids[i < count ? i : count - 1]->GetAABB(0);
      // Enlarged like the boxes in the broad phase of Box2D. Due to rounding, Box2D can report a
      // hit on a circle outside of the box of the circle.
      min_x[i] = box.lowerBound.x - b2_aabbExtension;
      min_y[i] = box.lowerBound.y - b2_aabbExtension;
      max_x[i] = box.upperBound.x + b2_aabbExtension;
      max_y[i] = box.upperBound.y + b2_aabbExtension;
    }
    Candidates found;
    find_boxes(min_x, min_y, max_x, max_y, found);
    for (std::size_t i = 0; i < count; ++i) {
      const b2Fixture& fixture = *solids[i];
      const Interval rays{found.begin[i], found.end[i]};
      if (fixture.IsSensor() || !frame.masks.pass(fixture.GetFilterData().categoryBits) ||
          !is_visible(rays, found.distance[i] * kCircleRounding)) {
        continue;
      }
      Object object{};
      if constexpr (kFindsFixtures) {
        object = object_of(slot_of(fixture));
        if (object.pass_limit == Materials::kInvisible) continue;
      }
      const b2Transform& body = fixture.GetBody()->GetTransform();
      if (fixture.GetType() == b2Shape::e_circle) {
        draw_circle(*static_cast<const b2CircleShape*>(fixture.GetShape()), body, rays, object);
      } else {
        draw_polygon(*static_cast<const b2PolygonShape*>(fixture.GetShape()), body, rays, object);
      }
    }
  }
};

void set_frame(const ScanView& scan, const ScanFrame& frame, const b2Transform& body) {
  Kernel<false>{scan, frame, nullptr}.set_frame(body);
}

void draw_tree(const ScanView& scan, const ScanFrame& frame, const EdgeTree::Node* nodes,
               const EdgeTree::Leaf* leaves) {
  const Kernel<false> kernel{scan, frame, nullptr};
  kernel.traverse(nodes, 1.0F, [&](std::uint32_t leaf, Interval rays) {
    kernel.draw_leaf(leaves[leaf], nullptr, rays);
  });
}

void find_in_tree(const ScanView& scan, const ScanFrame& frame, const HitView& hits,
                  const EdgeTree::Node* nodes, const EdgeTree::Leaf* leaves,
                  const EdgeTree::LeafFixtures* fixtures) {
  const Kernel<true> kernel{scan, frame, &hits};
  kernel.traverse(nodes, 1.0F, [&](std::uint32_t leaf, Interval rays) {
    kernel.draw_leaf(leaves[leaf], fixtures + leaf, rays);
  });
}

template <bool kFindsFixtures>
FLATLAND_INLINE void draw_all(const Kernel<kFindsFixtures>& kernel, b2Fixture* const* solids,
                              std::size_t count) {
  for (std::size_t i = 0; i < count; i += simd::kWidth) {
    kernel.draw_solids(solids + i, count - i < simd::kWidth ? count - i : simd::kWidth);
  }
}

void draw_solids(const ScanView& scan, const ScanFrame& frame, b2Fixture* const* solids,
                 std::size_t count) {
  draw_all(Kernel<false>{scan, frame, nullptr}, solids, count);
}

void find_in_solids(const ScanView& scan, const ScanFrame& frame, const HitView& hits,
                    b2Fixture* const* solids, std::size_t count) {
  draw_all(Kernel<true>{scan, frame, &hits}, solids, count);
}

template <bool kFindsFixtures>
FLATLAND_INLINE void draw_leaves(const Kernel<kFindsFixtures>& kernel, const EdgeTree::Node* nodes,
                                 b2Fixture* const* solids, std::size_t count) {
  kernel.traverse(nodes, kCircleRounding, [&](std::uint32_t leaf, Interval) {
    const std::size_t first = simd::kWidth * leaf;
    kernel.draw_solids(solids + first, count - first < simd::kWidth ? count - first : simd::kWidth);
  });
}

void draw_solid_tree(const ScanView& scan, const ScanFrame& frame, const EdgeTree::Node* nodes,
                     b2Fixture* const* solids, std::size_t count) {
  draw_leaves(Kernel<false>{scan, frame, nullptr}, nodes, solids, count);
}

void find_in_solid_tree(const ScanView& scan, const ScanFrame& frame, const HitView& hits,
                        const EdgeTree::Node* nodes, b2Fixture* const* solids, std::size_t count) {
  draw_leaves(Kernel<true>{scan, frame, &hits}, nodes, solids, count);
}
