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
  b2Transform pose;  // pose of the sensor in the world frame
  NoiseKey key;
  Readings out;
};

// Performs all scans, on up to `num_threads` threads; 0 for as many as are available. The scenes
// must not change meanwhile. The readings of a scan depend neither on the number of threads nor on
// other scans.
void scan_all(const std::vector<ScanJob>& jobs, ThreadPool& pool, std::size_t num_threads);

}  // namespace flatland
