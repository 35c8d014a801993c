// Independent jobs on several threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>

namespace flatland {

// Returns the number of threads that can run at the same time, at least 1: the number of processors
// that the process may use, reduced to the quota of the control group.
std::size_t available_threads();

// A set of worker threads. The first call starts the threads, which then wait for the next call:
// actively for a short time if the calls follow each other closely, otherwise asleep. A pool
// without calls has no threads. Several threads may call `parallel_for` concurrently.
//
// Jobs must not acquire the GIL: a thread that stops the pool may hold it.
class ThreadPool {
 public:
  using Job = std::function<void(std::size_t)>;

  ThreadPool() = default;
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  // Calls job(i) once for each i from 0 to jobs - 1, on up to `num_threads` threads (0: as many as
  // are available), of which the calling thread is one. Threads take jobs in order of i as they
  // become free. Returns when all jobs have ended. If jobs throw, the other jobs are still carried
  // out; then the exception of the first job, in order of i, is rethrown.
  //
  // While the pool is in use by another thread, or in a job of the same pool, the calling thread
  // carries out all jobs. The same happens if no thread can be created.
  //
  // After a fork, the child process starts workers of its own.
  void parallel_for(std::size_t jobs, std::size_t num_threads, Job job);

  class Work;
  // The same in two parts: the workers begin with the jobs, and `Work::finish` does the rest. The
  // pool must exist until then.
  std::unique_ptr<Work> start(std::size_t jobs, std::size_t num_threads, Job job);

  // Ends the workers; the next call starts new ones. Like the destructor, it must not be called
  // while jobs are carried out.
  void stop();

 private:
  class Crew;
  class Batch;

  // The workers of this process, created if there are none.
  Crew& crew();

  std::atomic<Crew*> crew_{nullptr};
};

// Jobs that workers have begun to carry out.
class ThreadPool::Work {
 public:
  ~Work();
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  // Carries out the jobs that no worker has begun, waits for the others, and rethrows. Idempotent.
  void finish();

 private:
  friend class ThreadPool;
  Work(std::size_t jobs, Job job);
  void complete();

  std::unique_ptr<Batch> batch_;
  Crew* crew_ = nullptr;  // which works on the batch
  bool is_complete_ = false;
};

}  // namespace flatland
