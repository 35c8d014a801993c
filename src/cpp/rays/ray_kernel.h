// A vector of rays and their hits; a part of depth_kernel.h.
//
// With kFindsFixtures, the kernel also records which fixture each ray hits, and fixtures may let
// rays pass (see HitRules). If several fixtures are at the same distance, the recorded fixture
// depends neither on the instruction set nor on other scans: edges are always drawn in the same
// order, and circles and polygons replace fixtures with higher slots.

template <bool kFindsFixtures>
struct RayKernel {
  using Floats = Lanes::Floats;
  using Words = Lanes::Words;
  using Mask = Lanes::Mask;

  const ScanView& scan;
  const ScanFrame& frame;
  const HitView* hits;  // null without kFindsFixtures

  // A fixture that is drawn; used only with kFindsFixtures.
  struct Object {
    std::uint32_t fixture;
    const Optics* optics;
  };

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

  // Returns whether one of the rays reaches a distance.
  FLATLAND_INLINE bool is_visible(Interval rays, float distance) const {
    const Floats least = Lanes::broadcast(distance * scan.fraction_per_metre);
    return any_of(rays, [&](std::int32_t first, std::int32_t begin, std::int32_t end) {
      return Lanes::any(Lanes::both(Lanes::less_equal(least, Lanes::load(scan.fraction + first)),
                                    Lanes::range(begin - first, end - first)));
    });
  }

  // Records the hits of a vector of rays that are nearer than the previous hits; NaN is a miss.
  // `height` is the length of a ray times the cosine of the angle of incidence, with either sign.
  FLATLAND_INLINE void record_hits(std::int32_t first, Floats fraction, Floats height, Mask is_hit,
                                   const Object& object) const {
    const Floats before = Lanes::load(scan.fraction + first);
    if constexpr (kFindsFixtures) {
      Floats fixture = Lanes::load(hits->fixture + first);
      const Mask is_ahead = Lanes::less_equal(least_fraction(first), fraction);
      const Mask is_first = Lanes::less(Lanes::words(object.fixture), Lanes::as_words(fixture));
      const Mask is_nearer = Lanes::either(Lanes::less(fraction, before),
                                           Lanes::both(Lanes::equal(fraction, before), is_first));
      Mask is_new = Lanes::both(Lanes::both(is_hit, is_ahead), is_nearer);
      if (!Lanes::any(is_new)) return;
      Floats brightness = brightness_of(height, object);
      apply_fate(first, object, is_new, brightness);
      Lanes::store(scan.fraction + first, Lanes::select(is_new, fraction, before));
      fixture = Lanes::select(is_new, Lanes::as_floats(Lanes::words(object.fixture)), fixture);
      Lanes::store(hits->fixture + first, fixture);
      brightness = Lanes::select(is_new, brightness, Lanes::load(hits->brightness + first));
      Lanes::store(hits->brightness + first, brightness);
    } else {
      const Mask is_nearer = Lanes::both(Lanes::less_equal(Lanes::broadcast(0.0F), fraction),
                                         Lanes::less(fraction, before));
      Lanes::store(scan.fraction + first,
                   Lanes::select(Lanes::both(is_hit, is_nearer), fraction, before));
    }
  }

  // Returns the least fractions of the hits of a vector of rays.
  FLATLAND_INLINE Floats least_fraction(std::int32_t first) const {
    if (hits->nearest == nullptr) return Lanes::broadcast(0.0F);
    return Lanes::load(hits->nearest + first);
  }

  // Returns the brightness of hits of an object, which is proportional to the length of the ray.
  FLATLAND_INLINE Floats brightness_of(Floats height, const Object& object) const {
    return magnitude(height) * object.optics->reflectance;
  }

  // Removes the hits of a vector of rays that pass an object, and marks those that it reflects.
  FLATLAND_INLINE void apply_fate(std::int32_t first, const Object& object, Mask& is_hit,
                                  Floats& brightness) const {
    const Optics& optics = *object.optics;
    const bool has_fate = optics.pass_limit != Optics::kOpaque || reflects(optics);
    if (!has_fate || !Lanes::any(is_hit)) return;
    const auto* words = reinterpret_cast<const float*>(hits->words);
    Words fate = Lanes::as_words(Lanes::load(words + first));
    mix_fixture(fate, hits->leg ^ object.fixture);
    is_hit = Lanes::but_not(is_hit, Lanes::less(fate, Lanes::words(optics.pass_limit)));
    if (!reflects(optics)) return;
    const Mask is_scattered = Lanes::less(Lanes::words(optics.last_reflected), fate);
    brightness = Lanes::select(is_scattered, brightness, Lanes::broadcast(HitRules::kReflects));
  }

  FLATLAND_INLINE bool reflects(const Optics& optics) const {
    return optics.is_mirror && hits->leg == HitRules::kDirect;
  }

  // Returns a circle or polygon as an object.
  FLATLAND_INLINE Object object_of(std::uint32_t fixture) const {
    const std::uint16_t number = fixture < hits->count ? hits->number[fixture] : std::uint16_t{0};
    return {fixture, hits->optics + number};
  }

  // Computes the end points of a vector of rays in the world frame.
  FLATLAND_INLINE void load_ends(std::int32_t first, Floats& x, Floats& y) const {
    const b2Transform& pose = scan.pose;
    const Floats fan_x = Lanes::load(scan.fan_x + first);
    const Floats fan_y = Lanes::load(scan.fan_y + first);
    x = (pose.q.c * fan_x - pose.q.s * fan_y) + pose.p.x;
    y = (pose.q.s * fan_x + pose.q.c * fan_y) + pose.p.y;
  }

  // Computes the vectors along the rays in the frame of a body.
  FLATLAND_INLINE void set_frame(const b2Transform& body) const {
    any_of(scan.drawn, [&](std::int32_t first, std::int32_t, std::int32_t) {
      Floats x, y;
      load_ends(first, x, y);
      x = x - body.p.x;
      y = y - body.p.y;
      Lanes::store(scan.d_x + first, (body.q.c * x + body.q.s * y) - frame.origin.x);
      Lanes::store(scan.d_y + first, (-body.q.s * x + body.q.c * y) - frame.origin.y);
      return false;
    });
  }

  static FLATLAND_INLINE Floats magnitude(Floats a) {
    return Lanes::as_floats(Lanes::as_words(a) & 0x7FFFFFFFU);
  }
};
