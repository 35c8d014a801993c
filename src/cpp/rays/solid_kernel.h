// Draws circles and polygons; a part of depth_kernel.h.

template <bool kFindsFixtures>
struct SolidKernel : BoxKernel<kFindsFixtures> {
  using Base = BoxKernel<kFindsFixtures>;
  using Base::any_of;
  using Base::find_boxes;
  using Base::frame;
  using Base::hits;
  using Base::is_visible;
  using Base::load_ends;
  using Base::object_of;
  using Base::record_hits;
  using Base::scan;
  using typename Base::Floats;
  using typename Base::Mask;
  using typename Base::Object;

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
      record_hits(first, a / rr, root / circle.m_radius,
                  Lanes::both(is_hit, Lanes::less_equal(a, rr)), object);
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
      Floats height = zero;
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
        height = Lanes::select(is_entry, denominator, height);
        upper = Lanes::select(is_exit, fraction, upper);
        enters = Lanes::either(enters, is_entry);
      }
      record_hits(first, lower, height,
                  Lanes::but_not(Lanes::both(enters, Lanes::less_equal(lower, upper)), misses),
                  object);
      return false;
    });
  }

  FLATLAND_INLINE void draw_group(const SolidGroup& group) const {
    Candidates found;
    find_boxes(group.min_x, group.min_y, group.max_x, group.max_y, (1U << group.count) - 1U, found);
    for (std::uint32_t set = found.set; set != 0; set &= set - 1) {
      const int i = __builtin_ctz(set);
      const b2Fixture& fixture = *group.solids[i];
      const Interval rays{found.begin[i], found.end[i]};
      if (fixture.IsSensor() || !frame.masks.pass(fixture.GetFilterData().categoryBits) ||
          !is_visible(rays, found.distance[i] * kCircleRounding)) {
        continue;
      }
      Object object{};
      if constexpr (kFindsFixtures) {
        object = object_of(slot_of(fixture));
        if (object.fixture == hits->excluded) continue;
        if (object.optics->pass_limit == Optics::kInvisible) continue;
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
