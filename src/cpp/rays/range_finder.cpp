#include "rays/range_finder.h"

#include <box2d/b2_body.h>
#include <box2d/b2_fixture.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "world/contacts.h"
#include "world/errors.h"

namespace flatland {
namespace {

// Replaces the first range by the shortest range, NaN if all beams are misses.
void keep_nearest(float* ranges, std::size_t count) {
  float nearest = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < count; ++i) {
    if (!(nearest <= ranges[i]) && !std::isnan(ranges[i])) nearest = ranges[i];
  }
  ranges[0] = nearest;
}

}  // namespace

RangeFinder::RangeFinder(std::shared_ptr<const BeamFan> fan, const Parameters& parameters)
    : fan_(std::move(fan)), parameters_(parameters) {
  if (parameters.noise && !(parameters.length <= parameters.noise->max_range())) {
    throw std::invalid_argument("length must be at most the max_range of the noise, " +
                                to_text(static_cast<double>(parameters.noise->max_range())) +
                                ", got " + to_text(static_cast<double>(parameters.length)));
  }
}

Triple RangeFinder::pose_of(const Triple& body) const {
  // The operations of flatland.geometry.compose.
  const auto& [x, y, theta] = body;
  const auto& [dx, dy, turn] = parameters_.origin;
  const double c = std::cos(theta);
  const double s = std::sin(theta);
  return {x + c * dx - s * dy, y + s * dx + c * dy, theta + turn};
}

void RangeFinder::scan(const SceneView& scene, const b2Transform& pose, const NoiseKey& key,
                       const Readings& out, ScanMemory& memory) const {
  memory.ranges.resize(beams() + AlignedFloats::kBlock);
  const bool needs_hits = out.intensities != nullptr || out.hits != nullptr;
  if (needs_hits && memory.flags < beams()) {
    memory.reflects = std::make_unique<bool[]>(beams());
    memory.is_hit = std::make_unique<bool[]>(beams());
    memory.flags = beams();
  }
  const bool is_traced = sees_materials(scene.scene()) || out.hits != nullptr;
  if (is_traced) {
    scan_traced(scene, pose, key, out, memory);
  } else {
    scan_plain(scene, pose, out, memory);
  }
  float* ranges = memory.ranges.data();
  if (parameters_.is_cone) keep_nearest(ranges, beams());

  const bool may_replace = parameters_.noise && parameters_.noise->replaces_hits();
  const bool* is_hit = needs_hits && may_replace ? memory.is_hit.get() : nullptr;
  if (parameters_.noise) {
    parameters_.noise->apply(ranges, readings(), key, parameters_.limits,
                             is_hit == nullptr ? nullptr : memory.is_hit.get());
  } else {
    apply_limits(ranges, readings(), parameters_.limits);
  }
  std::copy_n(ranges, readings(), out.ranges);
  if (out.intensities != nullptr && !is_traced) {
    for (std::size_t i = 0; i < beams(); ++i) {
      out.intensities[i] = memory.reflects[i] ? kFullIntensity : 0.0F;
    }
  }
  for (std::size_t i = 0; out.intensities != nullptr && is_hit != nullptr && i < beams(); ++i) {
    if (!is_hit[i]) out.intensities[i] = 0.0F;
  }
  for (std::size_t i = 0; out.hits != nullptr && i < beams(); ++i) {
    const bool is_measured = is_hit == nullptr || is_hit[i];
    if (!is_measured || !std::isfinite(ranges[i])) out.hits->labels[i] = 0;
  }
}

void RangeFinder::scan_plain(const SceneView& scene, const b2Transform& pose, const Readings& out,
                             ScanMemory& memory) const {
  DepthScan hits(*fan_, pose, memory.buffer);
  scene.draw(hits, {parameters_.mask, kAnyCategory});
  write_ranges(hits.fractions(), memory.ranges.data());
  if (out.intensities == nullptr) return;
  std::fill_n(memory.reflects.get(), beams(), false);
  find_reflections(hits, scene, *fan_, {parameters_.mask, parameters_.reflect_mask}, memory.limits,
                   memory.reflects.get());
}

void RangeFinder::scan_traced(const SceneView& scene, const b2Transform& pose, const NoiseKey& key,
                              const Readings& out, ScanMemory& memory) const {
  const TraceRules rules{parameters_.mask, parameters_.reflect_mask, key,
                         sees_materials(scene.scene())};
  trace(scene, *fan_, pose, rules, memory.trace);
  write_ranges(memory.trace.ends.fraction.data(), memory.ranges.data());
  if (out.intensities != nullptr) write_intensities(memory.trace, out.intensities);
  if (out.hits != nullptr) write_labels(scene.scene(), memory.trace.ends, *out.hits);
}

void RangeFinder::write_intensities(TraceMemory& trace, float* intensities) const {
  float* brightness = trace.ends.brightness.data();
  const std::size_t count = fan_->count();
  to_intensities(trace.ends.fraction.data(), fan_->length(), count, parameters_.length, brightness);
  for (std::size_t i = 0; parameters_.reflect_mask != 0 && i < count; ++i) {
    if (trace.is_preferred[i] != 0) brightness[i] = kFullIntensity;
  }
  for (const BeamFan::Run& run : fan_->runs()) {
    std::copy_n(brightness + run.sorted, run.count, intensities + run.original);
  }
  if (!fan_->runs().empty()) return;
  std::fill_n(intensities, beams(), 0.0F);
  for (std::size_t i = 0; i < count; ++i) intensities[fan_->order()[i]] = brightness[i];
}

void RangeFinder::write_labels(const RayScene& scene, const ScanBuffer& ends,
                               HitTable& hits) const {
  std::fill_n(hits.labels, beams(), 0U);
  hits.entries.clear();
  std::map<std::pair<Id, std::uint16_t>, std::uint32_t> label_of;
  std::uint32_t last_slot = HitRules::kNoFixture;
  std::uint32_t label = 0;
  for (std::size_t i = 0; i < fan_->count(); ++i) {
    if (!(ends.fraction[i] <= 1.0F)) continue;
    // Consecutive rays often hit the same fixture.
    if (ends.slots()[i] != last_slot) {
      last_slot = ends.slots()[i];
      const b2Fixture* fixture = scene.fixture_at(last_slot);
      const Id body = id_of(fixture->GetBody());
      const std::uint16_t bits = fixture->GetFilterData().categoryBits;
      const auto next = static_cast<std::uint32_t>(hits.entries.size() + 1);
      const auto [known, is_new] = label_of.try_emplace({body, bits}, next);
      label = known->second;
      if (is_new) hits.entries.push_back({body, bits});
    }
    hits.labels[fan_->order()[i]] = label;
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
