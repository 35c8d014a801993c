#include "crowd/gait.h"

#include <algorithm>
#include <cmath>

namespace flatland::crowd {

double step_length(double speed) { return 0.235 + 0.302 * speed; }

double advance_phase(double phase, double distance, double speed) {
  const double next = phase + distance / (2.0 * step_length(speed));
  return next - std::floor(next);
}

double leg_offset(double phase, double speed) {
  // Below this speed, steps become shorter, so that both legs stand side by side in the end.
  constexpr double kFullSteps = 0.3;  // m/s
  const double half = 0.5 * step_length(speed) * std::min(speed / kFullSteps, 1.0);
  // The wave falls from +1 to -1 while the body passes over the standing left leg, and rises again
  // while the leg swings.
  const double wave = phase < 0.5 ? 1.0 - 4.0 * phase : 4.0 * phase - 3.0;
  return half * wave;
}

}  // namespace flatland::crowd
