#include "rays/range_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "world/errors.h"

namespace flatland {
namespace {

constexpr float kReflective = 255.0F;

}  // namespace

RangeFinder::RangeFinder(std::shared_ptr<const BeamFan> fan, const Parameters& parameters)
    : fan_(std::move(fan)), parameters_(parameters) {
  if (parameters.noise && !(parameters.length <= parameters.noise->max_range())) {
    throw std::invalid_argument("length must be at most the max_range of the noise, " +
                                to_text(static_cast<double>(parameters.noise->max_range())) +
                                ", got " + to_text(static_cast<double>(parameters.length)));
  }
}

std::array<double, 3> RangeFinder::pose_of(const std::array<double, 3>& body) const {
  // The operations of flatland.geometry.compose.
  const auto& [x, y, theta] = body;
  const auto& [dx, dy, turn] = parameters_.origin;
  const double c = std::cos(theta);
  const double s = std::sin(theta);
  return {x + c * dx - s * dy, y + s * dx + c * dy, theta + turn};
}

void RangeFinder::scan(const SceneView& scene, const b2Transform& pose, const NoiseKey& key,
                       const Readings& out, ScanMemory& memory) const {
  DepthScan hits(*fan_, pose, memory.buffer);
  scene.draw(hits, {parameters_.mask, kAnyCategory});
  memory.ranges.resize(beams() + AlignedFloats::kBlock);
  float* ranges = memory.ranges.data();
  write_ranges(hits.fractions(), ranges);

  bool* is_hit = nullptr;
  if (out.intensities != nullptr) {
    if (memory.flags < beams()) {
      memory.reflects = std::make_unique<bool[]>(beams());
      memory.is_hit = std::make_unique<bool[]>(beams());
      memory.flags = beams();
    }
    std::fill_n(memory.reflects.get(), beams(), false);
    is_hit = memory.is_hit.get();
    find_reflections(hits, scene, *fan_, {parameters_.mask, parameters_.reflect_mask},
                     memory.limits, memory.reflects.get());
  }
  if (parameters_.noise) {
    parameters_.noise->apply(ranges, beams(), key, parameters_.limits, is_hit);
  } else {
    if (is_hit != nullptr) std::fill_n(is_hit, beams(), true);
    apply_limits(ranges, beams(), parameters_.limits);
  }
  std::copy_n(ranges, beams(), out.ranges);
  for (std::size_t i = 0; out.intensities != nullptr && i < beams(); ++i) {
    out.intensities[i] = memory.reflects[i] && is_hit[i] ? kReflective : 0.0F;
  }
}

void RangeFinder::write_ranges(const float* fractions, float* ranges) const {
  for (const BeamFan::Run& run : fan_->runs()) {
    to_ranges(fractions + run.sorted, run.count, parameters_.length, ranges + run.original);
  }
  if (!fan_->runs().empty()) return;
  std::fill_n(ranges, beams(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < fan_->count(); ++i) {
    if (fractions[i] <= 1.0F) ranges[fan_->order()[i]] = fractions[i] * parameters_.length;
  }
}

}  // namespace flatland
