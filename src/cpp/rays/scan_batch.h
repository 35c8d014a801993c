// Scans of many range finders, in one or several worlds, on several threads.
#pragma once

#include <box2d/b2_math.h>

#include <cstddef>
#include <vector>

#include "parallel/thread_pool.h"
#include "rays/range_finder.h"

namespace flatland {

struct ScanJob {
  RayScene* scene;
  const RangeFinder* finder;
  b2Transform pose;  // of the sensor, world frame
  NoiseKey key;
  Readings out;
};

// Performs all scans. The scenes must not change meanwhile. The readings do not depend on the
// number of threads (0: as many as are available) nor on the other scans.
void scan_all(const std::vector<ScanJob>& jobs, ThreadPool& pool, std::size_t num_threads);

}  // namespace flatland
