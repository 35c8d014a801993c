// The loops over the ranges of a scan, in range_noise.cpp; see every_instruction_set.h. All arrays
// have whole blocks.

#include "rays/random_kernel.h"

// Replaces the ranges that the sensor does not report: hits that are too close, and misses (NaN).
struct Limits {
  using Floats = Lanes::Floats;

  Floats shortest, no_hit;
  bool is_bounded;
  Floats least, most, below, above;  // bounds of readings with noise, and what replaces others

  explicit FLATLAND_INLINE Limits(const RangeLimits& limits)
      : shortest(Lanes::broadcast(limits.range_min > 0.0F ? limits.range_min : -kInfinity)),
        no_hit(Lanes::broadcast(limits.no_hit)),
        is_bounded(limits.out_of_range != RangeLimits::OutOfRange::kKeep),
        least(Lanes::broadcast(limits.range_min)),
        most(Lanes::broadcast(limits.range_max)),
        below(drops(limits) ? Lanes::broadcast(-kInfinity) : least),
        above(drops(limits) ? Lanes::broadcast(kNaN) : most) {}

  static bool drops(const RangeLimits& limits) {
    return limits.out_of_range == RangeLimits::OutOfRange::kDrop;
  }

  // Bounds readings with noise. Hits that are too close without noise are not raised.
  FLATLAND_INLINE Floats bound(Floats exact, Floats range) const {
    const Floats raised = Lanes::select(Lanes::less(exact, least), range, below);
    const Floats lowered = Lanes::select(Lanes::less(most, range), above, range);
    return Lanes::select(Lanes::less(range, least), raised, lowered);
  }

  FLATLAND_INLINE Floats apply(Floats range) const {
    const Floats low = Lanes::broadcast(-kInfinity);
    const Floats measured = Lanes::select(Lanes::less(range, shortest), low, range);
    return Lanes::select(Lanes::not_equal(range, range), no_hit, measured);
  }
};

void limit(float* ranges, std::size_t count, const RangeLimits& limits) {
  const Limits kept(limits);
  for (std::size_t i = 0; i < count; i += Lanes::kWidth) {
    Lanes::store(ranges + i, kept.apply(Lanes::load(ranges + i)));
  }
}

// Converts the fractions of consecutive rays to ranges, NaN for a miss; `count` is rounded up.
void scale(const float* fractions, std::size_t count, float length, float* ranges) {
  const Lanes::Floats nan = Lanes::broadcast(kNaN);
  const Lanes::Floats one = Lanes::broadcast(1.0F);
  for (std::size_t i = 0; i < count; i += Lanes::kWidth) {
    const Lanes::Floats fraction = Lanes::load(fractions + i);
    Lanes::store(ranges + i,
                 Lanes::select(Lanes::less_equal(fraction, one), fraction * length, nan));
  }
}

// Converts the brightnesses of rays to intensities; see `to_intensities`.
void dim(const float* fractions, const float* lengths, std::size_t count, float max_range,
         float* brightness) {
  const Lanes::Floats zero = Lanes::broadcast(0.0F);
  const Lanes::Floats one = Lanes::broadcast(1.0F);
  const Lanes::Floats full = Lanes::broadcast(kFullIntensity);
  for (std::size_t i = 0; i < count; i += Lanes::kWidth) {
    const Lanes::Floats fraction = Lanes::load(fractions + i);
    const Lanes::Floats range = Lanes::max(fraction * max_range, one);
    const Lanes::Floats area = range * range * Lanes::load(lengths + i);
    const Lanes::Floats intensity = Lanes::min(full * Lanes::load(brightness + i) / area, full);
    Lanes::store(brightness + i, Lanes::select(Lanes::less_equal(fraction, one), intensity, zero));
  }
}

// Adds normal noise to exact ranges, and applies the limits. Beams form groups of 64. The four
// words of a counter belong to four beams of a group that are 16 beams apart.
void add_normal_noise(float* ranges, std::size_t count, const NoiseKey& key, float deviation,
                      bool is_proportional, const RangeLimits& limits) {
  using Floats = Lanes::Floats;
  const Limits kept(limits);
  const auto add = [&](std::size_t i, Floats normal) {
    if (i >= count) return;
    const Floats range = Lanes::load(ranges + i);
    Floats noise = normal * deviation;
    if (is_proportional) noise = noise * range;
    Floats noisy = range + noise;
    if (kept.is_bounded) noisy = kept.bound(range, noisy);
    Lanes::store(ranges + i, kept.apply(noisy));
  };
  for (std::size_t group = 0; group < count; group += kBeamsPerGroup) {
    const auto first_counter = static_cast<std::uint32_t>(group / 4);
    for (std::size_t lane = 0; lane < kBeamsPerGroup / 4; lane += Lanes::kWidth) {
      const RandomWords random(key, first_counter + static_cast<std::uint32_t>(lane), 0);
      const NormalPair low(random.word[0], random.word[1]);
      const NormalPair high(random.word[2], random.word[3]);
      const std::size_t beam = group + lane;
      add(beam, low.first);
      add(beam + kBeamsPerGroup / 4, low.second);
      add(beam + kBeamsPerGroup / 2, high.first);
      add(beam + 3 * kBeamsPerGroup / 4, high.second);
    }
  }
}

// Draws the random numbers of 16 beams: for each beam all words of one counter, and two normal
// numbers, which are computed from the second and the third word.
void draw_beams(const NoiseKey& key, std::uint32_t first_beam, BeamDraws& out) {
  for (std::size_t i = 0; i < kBeamsPerDraw; i += Lanes::kWidth) {
    const RandomWords random(key, first_beam + static_cast<std::uint32_t>(i), 0);
    const NormalPair normals(random.word[1], random.word[2]);
    Lanes::store(out.kind + i, random.word[0]);
    Lanes::store(out.exponent + i, random.word[1]);
    Lanes::store(out.uniform + i, random.word[3]);
    Lanes::store(out.normal[0] + i, normals.first);
    Lanes::store(out.normal[1] + i, normals.second);
  }
}

// Draws one random word for each beam. Beams share counters as in `add_normal_noise`.
void draw_words(const NoiseKey& key, std::size_t count, std::uint32_t* words) {
  for (std::size_t group = 0; group < count; group += kBeamsPerGroup) {
    const auto first_counter = static_cast<std::uint32_t>(group / 4);
    for (std::size_t lane = 0; lane < kBeamsPerGroup / 4; lane += Lanes::kWidth) {
      const RandomWords random(key, first_counter + static_cast<std::uint32_t>(lane),
                               kWordsAttempt);
      for (std::size_t part = 0; part < 4; ++part) {
        Lanes::store(words + group + lane + part * (kBeamsPerGroup / 4), random.word[part]);
      }
    }
  }
}

constexpr Functions kFunctions{limit, scale, add_normal_noise, draw_beams, draw_words, dim};
