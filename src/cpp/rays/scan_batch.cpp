#include "rays/scan_batch.h"

#include <algorithm>
#include <memory>
#include <unordered_map>

namespace flatland {
namespace {

// Number of consecutive scans that one thread performs with the same memory. A scan takes about
// 10 us.
constexpr std::size_t kScansPerJob = 4;
// Least number of beams for which the start of another thread pays off.
constexpr std::size_t kBeamsPerThread = 1000;

}  // namespace

void scan_all(const std::vector<ScanJob>& jobs, ThreadPool& pool, std::size_t num_threads) {
  std::unordered_map<const RayScene*, std::size_t> scans;
  std::size_t beams = 0;
  for (const ScanJob& job : jobs) {
    ++scans[job.scene];
    beams += job.finder->beams();
  }
  std::unordered_map<const RayScene*, std::unique_ptr<SceneView>> views;
  std::vector<const SceneView*> view_of(jobs.size());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    std::unique_ptr<SceneView>& view = views[jobs[i].scene];
    if (view == nullptr) {
      view = std::make_unique<SceneView>(*jobs[i].scene, scans[jobs[i].scene]);
    }
    view_of[i] = view.get();
  }
  if (beams < 2 * kBeamsPerThread) num_threads = 1;
  const bool has_many = num_threads != 1 && jobs.size() >= 8 * kScansPerJob;
  const std::size_t per_job = num_threads == 1 ? jobs.size() : (has_many ? kScansPerJob : 1);
  const std::size_t parts = per_job == 0 ? 0 : (jobs.size() + per_job - 1) / per_job;
  pool.parallel_for(parts, num_threads, [&](std::size_t part) {
    ScanMemoryPool& memories = jobs[part * per_job].scene->memories();
    std::unique_ptr<ScanMemory> memory = memories.take();
    const std::size_t end = std::min(jobs.size(), (part + 1) * per_job);
    for (std::size_t i = part * per_job; i < end; ++i) {
      const ScanJob& job = jobs[i];
      job.finder->scan(*view_of[i], job.pose, job.key, job.out, *memory);
    }
    memories.give_back(std::move(memory));
  });
}

}  // namespace flatland
