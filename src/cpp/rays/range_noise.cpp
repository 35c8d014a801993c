#include "rays/range_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "rays/instruction_set.h"
#include "rays/simd.h"
#include "world/errors.h"
#if defined(__x86_64__)
#include "rays/simd_x86.h"
#endif

namespace flatland {
namespace {

// Number of beams that share 16 counters; see add_normal_noise.
constexpr std::size_t kBeamsPerGroup = kWordsPerGroup;
constexpr std::size_t kBeamsPerDraw = 16;
// The attempt in the counters of `draw_words`. Noise uses the attempts 0, 1, and so on.
constexpr std::uint32_t kWordsAttempt = 0x80000000U;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Random numbers of 16 beams for the beam model.
struct BeamDraws {
  std::uint32_t kind[kBeamsPerDraw], exponent[kBeamsPerDraw], uniform[kBeamsPerDraw];
  float normal[2][kBeamsPerDraw];
};

namespace single {
using Lanes = simd::Lanes1;
#include "rays/random_kernel.h"
}  // namespace single

struct Functions {
  void (*limit)(float*, std::size_t, const RangeLimits&);
  void (*scale)(const float*, std::size_t, float, float*);
  void (*add_normal_noise)(float*, std::size_t, const NoiseKey&, float, bool, const RangeLimits&);
  void (*draw_beams)(const NoiseKey&, std::uint32_t, BeamDraws&);
  void (*draw_words)(const NoiseKey&, std::size_t, std::uint32_t*);
  void (*dim)(const float*, const float*, std::size_t, float, float*);
};

#define FLATLAND_KERNEL "rays/range_kernel.h"
#include "rays/every_instruction_set.h"

// Returns a number that is uniformly distributed in (0, 1).
double to_uniform(std::uint32_t random) {
  return (static_cast<double>(random) + 0.5) / 4294967296.0;
}

// The random words of one beam from the second counter on.
class MoreWords {
 public:
  MoreWords(const NoiseKey& key, std::uint32_t beam) : key_(key), beam_(beam) {}

  single::RandomWords next() { return {key_, beam_, ++attempt_}; }

 private:
  const NoiseKey& key_;
  std::uint32_t beam_;
  std::uint32_t attempt_ = 0;
};

// Draws from a normal distribution, truncated to an interval that contains the mean and is at least
// as wide as the deviation. A draw of the rejection method is accepted with a probability of more
// than 0.34.
class TruncatedNormal {
 public:
  TruncatedNormal(float mean, float deviation, float high)
      : mean_(mean), deviation_(deviation), high_(high) {}

  float draw(float first, float second, MoreWords words) const {
    float result;
    if (accepts(first, result) || accepts(second, result)) return result;
    while (true) {
      const single::RandomWords random = words.next();
      for (int i = 0; i < 4; i += 2) {
        const single::NormalPair pair(random.word[i], random.word[i + 1]);
        if (accepts(pair.first, result) || accepts(pair.second, result)) return result;
      }
    }
  }

 private:
  bool accepts(float normal, float& result) const {
    result = mean_ + normal * deviation_;
    return result >= 0.0F && result <= high_;
  }

  float mean_, deviation_, high_;
};

// Draws from an exponential distribution, truncated to [0, high]. The rejection method draws from
// the exponential distribution if the greater part is in the interval, otherwise from the uniform
// distribution. In the second case, x is accepted with the probability exp(-lambda x), which is the
// probability that an exponentially distributed number is above lambda x. A draw is accepted with a
// probability of more than 0.36.
class TruncatedExponential {
 public:
  TruncatedExponential(double lambda, float high) : lambda_(lambda), high_(high) {}

  float draw(std::uint32_t uniform, std::uint32_t exponent, MoreWords words) const {
    float result;
    if (accepts(uniform, exponent, result)) return result;
    while (true) {
      const single::RandomWords random = words.next();
      if (accepts(random.word[0], random.word[1], result) ||
          accepts(random.word[2], random.word[3], result)) {
        return result;
      }
    }
  }

 private:
  bool accepts(std::uint32_t uniform, std::uint32_t exponent, float& result) const {
    const double exponential = static_cast<double>(single::exponential(exponent));
    const auto high = static_cast<double>(high_);
    if (lambda_ * high > 1.0) {
      const double x = exponential / lambda_;
      result = static_cast<float>(x);
      return x <= high;
    }
    const double x = to_uniform(uniform) * high;
    result = static_cast<float>(x);
    return exponential >= lambda_ * x;
  }

  double lambda_;
  float high_;
};

}  // namespace

RangeNoise RangeNoise::additive(double deviation) {
  RangeNoise noise(Kind::kAdditive);
  noise.deviation_ = checked_not_negative(deviation, "deviation");
  return noise;
}

RangeNoise RangeNoise::proportional(double deviation) {
  RangeNoise noise(Kind::kProportional);
  noise.deviation_ = checked_not_negative(deviation, "deviation");
  return noise;
}

RangeNoise RangeNoise::beam(const BeamModel& model) {
  const double shares[4] = {model.z_hit, model.z_short, model.z_max, model.z_rand};
  double sum = 0.0;
  for (const double share : shares) {
    checked_not_negative(share, "share");
    sum += share;
  }
  if (!(sum > 0.0)) throw std::invalid_argument("the sum of the shares must be positive");
  RangeNoise noise(Kind::kBeam);
  noise.max_range_ = checked_not_negative(model.max_range, "max_range");
  noise.sigma_ = checked_not_negative(model.sigma_hit, "sigma_hit");
  noise.lambda_ = model.lambda_short;
  if (!(noise.max_range_ > 0.0F) || noise.sigma_ > noise.max_range_) {
    throw std::invalid_argument("max_range must be positive and at least sigma_hit, got " +
                                to_text(model.max_range) + " and " + to_text(model.sigma_hit));
  }
  if (!(noise.lambda_ > 0.0 && noise.lambda_ <= kMaxMagnitude)) {
    throw std::invalid_argument("lambda_short must be positive and finite, got " +
                                to_text(model.lambda_short));
  }
  // The sum of all shares is exactly 1, so that a kind with a share of 0 never occurs.
  double cumulative = 0.0;
  for (int i = 0; i < 3; ++i) {
    cumulative += shares[i];
    const double bound = std::round(std::min(cumulative / sum, 1.0) * 4294967296.0);
    noise.bounds_[i] = static_cast<std::uint64_t>(bound);
  }
  return noise;
}

void RangeNoise::apply(float* ranges, std::size_t count, const NoiseKey& key,
                       const RangeLimits& limits, bool* is_hit) const {
  if (kind_ == Kind::kBeam) {
    apply_beam_model(ranges, count, key, is_hit);
    apply_limits(ranges, count, limits);
    return;
  }
  if (is_hit != nullptr) std::fill_n(is_hit, count, true);
  functions().add_normal_noise(ranges, count, key, deviation_, kind_ == Kind::kProportional,
                               limits);
}

void RangeNoise::apply_beam_model(float* ranges, std::size_t count, const NoiseKey& key,
                                  bool* is_hit) const {
  BeamDraws draws;
  for (std::size_t beam = 0; beam < count; ++beam) {
    const std::size_t i = beam % kBeamsPerDraw;
    const auto number = static_cast<std::uint32_t>(beam);
    if (i == 0) functions().draw_beams(key, number, draws);
    const std::uint32_t kind = draws.kind[i];
    const MoreWords words(key, number);
    float& range = ranges[beam];
    const bool is_kind_hit = kind < bounds_[0];
    if (is_hit != nullptr) is_hit[beam] = is_kind_hit;
    if (is_kind_hit) {
      if (sigma_ > 0.0F && !std::isnan(range)) {
        const TruncatedNormal distribution(range, sigma_, max_range_);
        range = distribution.draw(draws.normal[0][i], draws.normal[1][i], words);
      }
    } else if (kind < bounds_[1]) {
      const TruncatedExponential distribution(lambda_, std::isnan(range) ? max_range_ : range);
      range = distribution.draw(draws.uniform[i], draws.exponent[i], words);
    } else if (kind < bounds_[2]) {
      range = kNaN;
    } else {
      range = static_cast<float>(to_uniform(draws.uniform[i]) * static_cast<double>(max_range_));
    }
  }
}

void apply_limits(float* ranges, std::size_t count, const RangeLimits& limits) {
  functions().limit(ranges, count, limits);
}

void draw_words(const NoiseKey& key, std::size_t count, std::uint32_t* words) {
  functions().draw_words(key, count, words);
}

void to_intensities(const float* fractions, const float* lengths, std::size_t count,
                    float max_range, float* brightness) {
  functions().dim(fractions, lengths, count, max_range, brightness);
}

void to_ranges(const float* fractions, std::size_t count, float length, float* ranges) {
  functions().scale(fractions, count, length, ranges);
}

}  // namespace flatland
