// Noise of range finders: a function of a stream, the number of the update and the number of the
// beam, whatever else is computed before or at the same time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace flatland {

// Identifies the random numbers of one scan.
struct NoiseKey {
  std::uint64_t stream;
  std::uint64_t update;
};

// What a sensor does not report: readings below `range_min` [m] are -inf, misses are `no_hit`. If
// `range_min` is 0, readings remain as they are, even if noise makes them negative.
struct RangeLimits {
  float range_min;
  float no_hit;
};

// A noise model, immutable.
class RangeNoise {
 public:
  // Normal noise with a standard deviation [m], or one that is a ratio to the range [m/m].
  // Throw std::invalid_argument if the deviation is negative or not finite.
  static RangeNoise additive(double deviation);
  static RangeNoise proportional(double deviation);

  // Parameters of the beam model; see `beam`.
  struct BeamModel {
    double z_hit, z_short, z_max, z_rand;
    double sigma_hit;     // [m]
    double lambda_short;  // [1/m]
    double max_range;     // [m]
  };

  // The beam model of range finders: a reading is a hit with normal noise, truncated to the ranges
  // from 0 to the maximum; a short reading with an exponential distribution from 0 to the exact
  // range; a miss; or a random one with a uniform distribution up to the maximum range. The "hit"
  // of a beam without a hit is a miss, and its exact range the maximum. Source: S. Thrun, W.
  // Burgard, D. Fox, "Probabilistic Robotics" (2005), section 6.3.1.
  //
  // Throws std::invalid_argument if a share is negative or the sum of all is not positive, if
  // sigma_hit is not from 0 to the maximum range, or if lambda_short or max_range is not positive.
  static RangeNoise beam(const BeamModel& model);

  // The greatest exact range for which the model is defined [m].
  float max_range() const { return max_range_; }

  // Whether readings may be other than measurements of what the beams hit.
  bool replaces_hits() const { return kind_ == Kind::kBeam; }

  // Changes exact ranges, NaN for a miss, to measured ones, and applies the limits. `is_hit`,
  // unless null, becomes false for each reading that is not a measurement of what the beam hit.
  // Arrays have whole blocks (see AlignedFloats) for `count` beams.
  void apply(float* ranges, std::size_t count, const NoiseKey& key, const RangeLimits& limits,
             bool* is_hit) const;

 private:
  enum class Kind { kAdditive, kProportional, kBeam };

  explicit RangeNoise(Kind kind) : kind_(kind) {}
  void apply_beam_model(float* ranges, std::size_t count, const NoiseKey& key, bool* is_hit) const;

  Kind kind_;
  float deviation_ = 0.0F;
  // Bounds of the random words that stand for hits, short and missed readings.
  std::uint64_t bounds_[3] = {};
  float sigma_ = 0.0F;
  double lambda_ = 1.0;
  float max_range_ = std::numeric_limits<float>::max();
};

// Applies the limits to ranges without noise.
void apply_limits(float* ranges, std::size_t count, const RangeLimits& limits);

// Random words for the beams of one update, independent of its noise. Writes whole groups.
inline constexpr std::size_t kWordsPerGroup = 64;
void draw_words(const NoiseKey& key, std::size_t count, std::uint32_t* words);

// Ranges of consecutive rays [m], NaN for a miss, from their fractions of a length [m]. Writes
// whole vectors of up to 16 ranges.
void to_ranges(const float* fractions, std::size_t count, float length, float* ranges);

// The greatest intensity.
inline constexpr float kFullIntensity = 255.0F;

// Replaces the brightnesses of rays, which are proportional to their lengths, by the intensities of
// the hits: divides them by the square of the range, a fraction of `max_range` [m], if it is
// greater than 1 m. Writes 0 for a miss. Arrays have whole blocks.
void to_intensities(const float* fractions, const float* lengths, std::size_t count,
                    float max_range, float* brightness);

}  // namespace flatland
