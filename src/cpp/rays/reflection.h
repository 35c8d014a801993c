// The paths of rays after their reflection by mirrors.
#pragma once

#include <box2d/b2_math.h>

#include "rays/trace.h"

namespace flatland {

// Replaces the ends of the rays that mirrors reflect by the ends of the whole paths; see `trace`.
void reflect(const SceneView& scene, const BeamFan& fan, const b2Transform& pose,
             const TraceRules& rules, TraceMemory& memory);

}  // namespace flatland
