// The beams of a range finder, sorted by direction and shared by all scans.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "rays/aligned_floats.h"

namespace flatland {

struct MirroredFan;

// Rays from the origin of a rangefinder to points in its frame, sorted by diamond angle (see
// simd.h), with a lookup table for the rays between two angles. Immutable.
class BeamFan {
 public:
  BeamFan(const float* ends, std::size_t count);
  ~BeamFan();

  // Returns whether the fan was created from these end points.
  bool matches(const float* ends, std::size_t count) const;

  // Returns the number of end points.
  std::size_t size() const { return ends_.size() / 2; }

  // Returns the number of rays of non-zero length. Rays of zero length fill the last block of the
  // sorted arrays.
  std::size_t count() const { return order_.size(); }
  const float* x() const { return x_.data(); }
  const float* y() const { return y_.data(); }
  const float* length() const { return length_.data(); }
  // The index of each sorted ray in the array of end points.
  const std::vector<std::uint32_t>& order() const { return order_; }

  // Rays that are consecutive in both orders: `count` rays from `sorted` on, whose indices in the
  // array of end points begin at `original`.
  struct Run {
    std::size_t sorted, original, count;
  };
  // All rays as runs, in order of the indices in the array of end points: a vector that begins in a
  // run may extend into the next run. Empty if there are too many runs, or rays of zero length.
  const std::vector<Run>& runs() const { return runs_; }

  // Returns the fan with the opposite angles, which the first call creates. Thread-safe.
  const MirroredFan& mirrored() const;

  float min_length() const { return min_length_; }
  float max_length() const { return max_length_; }

  // The full circle is divided into 2^cell_bits cells. The entry of a cell is the first ray at or
  // after the start of the cell.
  int cell_bits() const { return cell_bits_; }
  const std::int32_t* first_in_cell() const { return first_in_cell_.data(); }

 private:
  void find_runs(std::size_t count);

  std::vector<float> ends_;
  std::vector<std::uint32_t> order_;
  std::vector<Run> runs_;
  AlignedFloats x_, y_, length_;
  std::vector<std::int32_t> first_in_cell_;
  int cell_bits_ = 8;
  float min_length_ = 0.0F;
  float max_length_ = 0.0F;
  mutable std::once_flag mirrored_flag_;
  mutable std::unique_ptr<const MirroredFan> mirrored_;
};

// The rays of a fan with the opposite angles.
struct MirroredFan {
  // Creates the fan from end points that differ from the origin.
  MirroredFan(const float* ends, std::size_t count);

  BeamFan fan;
  // The index in this fan of each sorted ray of the original fan.
  std::vector<std::uint32_t> place;
  // Whether the order of the rays is reversed, up to a rotation. This is the case if no rays have
  // the same direction.
  bool is_reversed;
};

// A cache of the most recently used fans: the rays of a laser are sorted only once. Thread-safe.
class FanCache {
 public:
  // Returns the fan with these end points, null if the cache does not contain the fan.
  std::shared_ptr<const BeamFan> find(const float* ends, std::size_t count);
  // Returns the fan with these end points, which must be finite.
  std::shared_ptr<const BeamFan> make(const float* ends, std::size_t count);
  // Shares the fans of another cache.
  void share(FanCache& other);

 private:
  static constexpr std::size_t kMaxFans = 16;

  std::mutex mutex_;
  std::vector<std::shared_ptr<const BeamFan>> fans_;  // most recently used first
};

}  // namespace flatland
