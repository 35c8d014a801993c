// Noise of range finders. The noise is a function of a stream, the number of the update and the
// number of the beam, and does not depend on the order of scans.
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

// The limits of readings: a reading below `range_min` [m] becomes -inf, a miss becomes `no_hit`. If
// `range_min` is 0, readings are not limited, even if noise makes them negative.
struct RangeLimits {
  // What becomes of readings of hits that normal noise makes too short or too long: they are kept,
  // become the limit, or become those of a hit that is too close (-inf) and of a miss.
  enum class OutOfRange { kKeep, kClamp, kDrop };

  float range_min;
  float no_hit;
  float range_max = std::numeric_limits<float>::infinity();
  OutOfRange out_of_range = OutOfRange::kKeep;
};

// A noise model, immutable.
class RangeNoise {
 public:
  // Return normal noise with a standard deviation in metres, or relative to the range [m/m]. Throw
  // std::invalid_argument if the deviation is negative or not finite.
  static RangeNoise additive(double deviation);
  static RangeNoise proportional(double deviation);

  // Parameters of the beam model; see `beam`.
  struct BeamModel {
    double z_hit, z_short, z_max, z_rand;
    double sigma_hit;     // [m]
    double lambda_short;  // [1/m]
    double max_range;     // [m]
  };

  // Returns the beam model of range finders. A reading is a hit with normal noise, truncated to the
  // ranges from 0 to the maximum; a short reading with an exponential distribution from 0 to the
  // exact range; a miss; or a random reading with a uniform distribution up to the maximum range.
  // For a beam that hits nothing, a hit is a miss, and the exact range is the maximum. Source:
  // S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics" (2005), section 6.3.1.
  //
  // Throws std::invalid_argument if a share is negative or the sum of all is not positive, if
  // sigma_hit is not from 0 to the maximum range, or if lambda_short or max_range is not positive.
  static RangeNoise beam(const BeamModel& model);

  // Returns the greatest exact range for which the model is defined [m].
  float max_range() const { return max_range_; }

  // Returns whether some readings are not measurements of hits, but short, missed or random.
  bool replaces_hits() const { return kind_ == Kind::kBeam; }

  // Replaces exact ranges, NaN for a miss, by measured ranges, and applies the limits. Sets
  // `is_hit`, unless null, to false for each reading that is not the measurement of a hit. Arrays
  // have whole blocks (see AlignedFloats) for `count` beams.
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

// Draws random words for the beams of one update, independent of the noise. Writes whole groups.
inline constexpr std::size_t kWordsPerGroup = 64;
void draw_words(const NoiseKey& key, std::size_t count, std::uint32_t* words);

// Converts fractions of a length [m] to ranges [m], NaN for a miss. Writes whole vectors of up to
// 16 ranges.
void to_ranges(const float* fractions, std::size_t count, float length, float* ranges);

// The greatest intensity.
inline constexpr float kFullIntensity = 255.0F;

// Replaces the brightnesses of rays by the intensities of the hits, 0 for a miss. A brightness is
// proportional to the length of the ray. An intensity decreases with the square of the range, which
// is the fraction times `max_range` [m], from 1 m on. Arrays have whole blocks.
void to_intensities(const float* fractions, const float* lengths, std::size_t count,
                    float max_range, float* brightness);

}  // namespace flatland
