// The directions of a scan, sorted once and used for many scans.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace flatland {

// Rays from the origin of a sensor to points in its frame, in order of their diamond angle (see
// simd.h), with a table that finds the rays between two angles. Never changes.
class BeamFan {
 public:
  // So many rays of no length come behind the others.
  static constexpr std::size_t kPadding = 7;

  BeamFan(const float* ends, std::size_t count);

  bool has_ends(const float* ends, std::size_t count) const;

  // Rays that have a length; the sorted arrays have `padded_count` entries.
  std::size_t count() const { return order_.size(); }
  std::size_t padded_count() const { return x_.size(); }
  const float* x() const { return x_.data(); }
  const float* y() const { return y_.data(); }
  const float* length() const { return length_.data(); }
  // Index of each sorted ray among those given.
  const std::vector<std::uint32_t>& order() const { return order_; }

  float shortest() const { return shortest_; }
  float longest() const { return longest_; }

  // The circle is cut into a power of two of cells. first_in(cell) is the first ray that is not
  // before the cell; cells and rays go on counting beyond the full circle in both directions.
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
  float shortest_ = 0.0F;
  float longest_ = 0.0F;
};

// The fans that were used last, so that a laser pays for sorting once. For use by many threads.
class FanCache {
 public:
  std::shared_ptr<const BeamFan> get(const float* ends, std::size_t count);

 private:
  static constexpr std::size_t kMostFans = 16;

  std::mutex mutex_;
  std::vector<std::shared_ptr<const BeamFan>> fans_;  // the latest first
};

}  // namespace flatland
