#include "rays/beam_fan.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace flatland {
namespace {

// Scalar version of simd::diamond_angle with bit-identical results.
float diamond_angle(float x, float y) {
  const float q = y / (std::abs(x) + std::abs(y));
  if (x < 0.0F) return 2.0F - q;
  return y < 0.0F ? q + 4.0F : q;
}

}  // namespace

BeamFan::BeamFan(const float* ends, std::size_t count) : ends_(ends, ends + 2 * count) {
  std::vector<float> angles(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float x = ends[2 * i];
    const float y = ends[2 * i + 1];
    if (!(x * x + y * y > 0.0F)) continue;  // the test of b2World::RayCast
    angles[i] = diamond_angle(x, y);
    order_.push_back(static_cast<std::uint32_t>(i));
  }
  const auto angle_less = [&](std::uint32_t a, std::uint32_t b) { return angles[a] < angles[b]; };
  if (!std::is_sorted(order_.begin(), order_.end(), angle_less)) {
    std::stable_sort(order_.begin(), order_.end(), angle_less);
  }

  x_.resize(order_.size());
  y_.resize(order_.size());
  length_.resize(order_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) {
    x_[i] = ends[2 * order_[i]];
    y_[i] = ends[2 * order_[i] + 1];
    length_[i] = std::sqrt(x_[i] * x_[i] + y_[i] * y_[i]);
  }
  if (!order_.empty()) {
    const float* begin = length_.data();
    const float* end = begin + order_.size();
    min_length_ = *std::min_element(begin, end);
    max_length_ = *std::max_element(begin, end);
  }

  constexpr int kMaxCellBits = 16;
  while (cell_bits_ < kMaxCellBits && (std::size_t{1} << cell_bits_) < 2 * order_.size()) {
    ++cell_bits_;
  }
  first_in_cell_.resize(std::size_t{1} << cell_bits_);
  const float cells_per_unit = static_cast<float>(first_in_cell_.size()) / 4.0F;
  std::size_t ray = 0;
  for (std::size_t cell = 0; cell < first_in_cell_.size(); ++cell) {
    while (ray < order_.size() && angles[order_[ray]] * cells_per_unit < static_cast<float>(cell)) {
      ++ray;
    }
    first_in_cell_[cell] = static_cast<std::int32_t>(ray);
  }
  find_runs(count);
}

BeamFan::~BeamFan() = default;

MirroredFan::MirroredFan(const float* ends, std::size_t count) : fan(ends, count), place(count) {
  // No ray has a length of zero, so `order_` contains all rays.
  for (std::size_t i = 0; i < count; ++i) place[fan.order()[i]] = static_cast<std::uint32_t>(i);
  is_reversed = true;
  for (std::size_t i = 1; i < count; ++i) {
    is_reversed =
        is_reversed && (place[i] + 1 == place[i - 1] || place[i] + 1 == place[i - 1] + count);
  }
}

const MirroredFan& BeamFan::mirrored() const {
  std::call_once(mirrored_flag_, [this] {
    std::vector<float> ends(2 * count());
    for (std::size_t i = 0; i < count(); ++i) {
      ends[2 * i] = x_[i];
      ends[2 * i + 1] = -y_[i];
    }
    mirrored_ = std::make_unique<const MirroredFan>(ends.data(), count());
  });
  return *mirrored_;
}

void BeamFan::find_runs(std::size_t count) {
  constexpr std::size_t kMaxRuns = 16;
  if (order_.size() != count) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0 && order_[i] == order_[i - 1] + 1) {
      ++runs_.back().count;
    } else {
      runs_.push_back({i, order_[i], 1});
    }
    if (runs_.size() > kMaxRuns) {
      runs_.clear();
      return;
    }
  }
  std::sort(runs_.begin(), runs_.end(),
            [](const Run& a, const Run& b) { return a.original < b.original; });
}

bool BeamFan::matches(const float* ends, std::size_t count) const {
  return ends_.size() == 2 * count &&
         (count == 0 || std::memcmp(ends_.data(), ends, 2 * count * sizeof(float)) == 0);
}

std::shared_ptr<const BeamFan> FanCache::find(const float* ends, std::size_t count) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = std::find_if(fans_.begin(), fans_.end(),
                                  [&](const auto& fan) { return fan->matches(ends, count); });
  if (known == fans_.end()) return nullptr;
  std::rotate(fans_.begin(), known, known + 1);
  return fans_.front();
}

void FanCache::share(FanCache& other) {
  const std::scoped_lock lock(mutex_, other.mutex_);
  fans_ = other.fans_;
}

std::shared_ptr<const BeamFan> FanCache::make(const float* ends, std::size_t count) {
  auto fan = std::make_shared<const BeamFan>(ends, count);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (fans_.size() == kMaxFans) fans_.pop_back();
  fans_.insert(fans_.begin(), fan);
  return fan;
}

}  // namespace flatland
