// Sorted ray directions, shared by all scans of a rangefinder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace flatland {

// Rays from the origin of a rangefinder to points in its frame, sorted by diamond angle (see
// simd.h), with a lookup table for the rays between two angles. Immutable.
class BeamFan {
 public:
  // Number of rays of zero length appended to the sorted arrays.
  static constexpr std::size_t kPadding = 7;

  BeamFan(const float* ends, std::size_t count);

  // Whether the fan was made from these end points.
  bool matches(const float* ends, std::size_t count) const;

  // Number of rays of non-zero length; the sorted arrays have `padded_count` entries.
  std::size_t count() const { return order_.size(); }
  std::size_t padded_count() const { return x_.size(); }
  const float* x() const { return x_.data(); }
  const float* y() const { return y_.data(); }
  const float* length() const { return length_.data(); }
  // For each sorted ray, its index in the array of end points.
  const std::vector<std::uint32_t>& order() const { return order_; }

  float min_length() const { return min_length_; }
  float max_length() const { return max_length_; }

  // The full circle is divided into cells; their number is a power of two. first_in(cell) is the
  // first ray at or after the start of a cell. The numbers of cells and rays continue beyond the
  // full circle in both directions.
  int cells() const { return 1 << cell_bits_; }
  std::int32_t first_in(std::int32_t cell) const {
    const std::int32_t turns = cell >> cell_bits_;
    return first_[static_cast<std::size_t>(cell & (cells() - 1))] +
           turns * static_cast<std::int32_t>(count());
  }

 private:
  std::vector<float> ends_;
  std::vector<std::uint32_t> order_;
  std::vector<float> x_, y_, length_;
  std::vector<std::int32_t> first_;
  int cell_bits_ = 8;
  float min_length_ = 0.0F;
  float max_length_ = 0.0F;
};

// The most recently used fans, so that the rays of a laser are sorted only once. Thread-safe.
class FanCache {
 public:
  std::shared_ptr<const BeamFan> get(const float* ends, std::size_t count);
  // Shares the fans of another cache.
  void share(FanCache& other);

 private:
  static constexpr std::size_t kMaxFans = 16;

  std::mutex mutex_;
  std::vector<std::shared_ptr<const BeamFan>> fans_;  // most recently used first
};

}  // namespace flatland
