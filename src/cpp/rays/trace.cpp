#include "rays/trace.h"

#include <box2d/b2_fixture.h>

#include <algorithm>

#include "rays/range_noise.h"
#include "rays/raycast.h"
#include "rays/reflection.h"

namespace flatland {
namespace {

// Marks the rays with a preferred fixture at the distance of the hit: casts the rays again at
// fixtures with preferred categories only, near the distances of the hits. See `find_reflections`
// in scene_view.h.
void find_preferred(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
                    const TraceRules& rules, TraceMemory& memory) {
  const HitRules hit_rules{nullptr, nullptr, HitRules::kDirect, HitRules::kNoFixture, 0};
  DepthScan hits(fan, pose, memory.image, hit_rules);
  const float* ends = memory.ends.fraction.data();
  const std::size_t count = fan.count();
  float* nearest = hits.limit_nearest();
  memory.limits.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float tolerance = kFractionTolerance + kDistanceTolerance / fan.length()[i];
    const float limit = std::min(ends[i] + tolerance, kMissFraction);
    hits.fractions()[i] = memory.limits[i] = ends[i] <= 1.0F ? limit : -1.0F;
    nearest[i] = std::max(ends[i] - tolerance, 0.0F);
  }
  scene.draw(hits, {rules.mask, rules.preferred});
  memory.is_preferred.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    memory.is_preferred[i] = static_cast<char>(hits.fractions()[i] < memory.limits[i]);
  }
}

}  // namespace

void trace(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
           const TraceRules& rules, TraceMemory& memory) {
  const Materials* materials = rules.uses_materials ? &scene.scene().materials() : nullptr;
  memory.words.resize((fan.count() + kWordsPerGroup - 1) / kWordsPerGroup * kWordsPerGroup);
  if (materials != nullptr && materials->needs_words()) {
    draw_words(rules.key, fan.count(), memory.words.data());
  }
  const HitRules hit_rules{materials, memory.words.data(), HitRules::kDirect, HitRules::kNoFixture,
                           rules.preferred};
  DepthScan hits(fan, pose, memory.ends, hit_rules);
  scene.draw(hits, {rules.mask, kAnyCategory});
  memory.is_preferred.clear();
  if (rules.preferred != 0) find_preferred(scene, fan, pose, rules, memory);
  if (materials != nullptr && materials->has_mirrors()) reflect(scene, fan, pose, rules, memory);
}

}  // namespace flatland
