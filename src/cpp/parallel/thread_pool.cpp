#include "parallel/thread_pool.h"

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <exception>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace flatland {
namespace {

// The greatest number of threads of a call. More threads would not save time.
constexpr std::size_t kMaxThreads = 256;

// If calls follow each other within this time, the threads of the pool wait for each other actively
// for as long, since a thread that sleeps takes about 50 us to wake up.
constexpr std::chrono::microseconds kWakefulTime{200};

using SteadyClock = std::chrono::steady_clock;

// Waits actively until a condition holds, at most for `kWakefulTime`.
template <typename Condition>
void wait_briefly(Condition holds) {
  const SteadyClock::time_point end = SteadyClock::now() + kWakefulTime;
  while (!holds() && SteadyClock::now() < end) std::this_thread::yield();
}

std::size_t allowed_processors() {
  // The call fails if the set is smaller than the set of the kernel.
  for (std::size_t size = 1024; size <= 1024 * 1024; size *= 2) {
    const std::unique_ptr<cpu_set_t, void (*)(cpu_set_t*)> set(
        CPU_ALLOC(size), [](cpu_set_t* allocated) { CPU_FREE(allocated); });
    const std::size_t bytes = CPU_ALLOC_SIZE(size);
    if (set != nullptr && sched_getaffinity(0, bytes, set.get()) == 0) {
      return static_cast<std::size_t>(CPU_COUNT_S(bytes, set.get()));
    }
  }
  return std::max(1U, std::thread::hardware_concurrency());
}

// Returns the number of processors that the control group (version 2) of the process may use on
// average, rounded up.
std::size_t processor_quota() {
  std::ifstream file("/sys/fs/cgroup/cpu.max");  // "QUOTA PERIOD" or "max PERIOD", in microseconds
  double quota = 0.0;
  double period = 0.0;
  if (!(file >> quota >> period) || !(quota > 0.0 && period > 0.0)) return kMaxThreads;
  return static_cast<std::size_t>(std::ceil(std::min<double>(kMaxThreads, quota / period)));
}

}  // namespace

std::size_t available_threads() {
  return std::max<std::size_t>(1, std::min(allowed_processors(), processor_quota()));
}

// The jobs of one call.
class ThreadPool::Batch {
 public:
  Batch(std::size_t count, Job job) : count_(count), job_(std::move(job)) {}

  // Carries out jobs until none is left.
  void work() {
    for (std::size_t i; (i = next_.fetch_add(1, std::memory_order_relaxed)) < count_;) {
      try {
        job_(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (failure_ == nullptr || i < failed_job_) {
          failure_ = std::current_exception();
          failed_job_ = i;
        }
      }
    }
  }

  // Must be called after all threads have left `work`.
  void rethrow() const {
    if (failure_ != nullptr) std::rethrow_exception(failure_);
  }

 private:
  const std::size_t count_;
  const Job job_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::exception_ptr failure_;
  std::size_t failed_job_ = 0;
};

// The workers of one process.
class ThreadPool::Crew {
 public:
  Crew() = default;
  ~Crew() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_stopped_ = true;
    }
    work_.notify_all();
    for (std::thread& worker : workers_) worker.join();
  }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  bool is_of_this_process() const { return process_ == getpid(); }
  std::size_t available() const { return available_; }

  // Makes up to `helpers` workers work on a batch. Returns false if the crew is busy.
  bool try_begin(Batch& batch, std::size_t helpers) {
    if (is_busy_.exchange(true, std::memory_order_acquire)) return false;
    hire(helpers);
    helpers = std::min(helpers, workers_.size());
    std::size_t asleep = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      batch_ = &batch;
      vacancies_ = helpers;
      asleep = helpers - std::min(helpers, awake_);
      is_wakeful_ = SteadyClock::now() - ended_ < kWakefulTime;
    }
    for (std::size_t i = 0; i < asleep; ++i) work_.notify_one();
    return true;
  }

  // Waits until the workers have left the batch.
  void end() {
    {
      // Workers that have not woken up yet are no longer needed.
      const std::lock_guard<std::mutex> lock(mutex_);
      batch_ = nullptr;
      vacancies_ = 0;
    }
    wait_briefly([this] { return working_ == 0; });
    std::unique_lock<std::mutex> lock(mutex_);
    done_.wait(lock, [this] { return working_ == 0; });
    ended_ = SteadyClock::now();
    lock.unlock();
    is_busy_.store(false, std::memory_order_release);
  }

 private:
  // Starts workers until there are `count`, or until the system cannot start another thread.
  void hire(std::size_t count) {
    if (workers_.size() >= count) return;
    // A signal of the process interrupts one of its other threads.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    try {
      while (workers_.size() < count) {
        workers_.emplace_back([this] { run(); });
        pthread_setname_np(workers_.back().native_handle(), "flatland-pool");
      }
    } catch (const std::system_error&) {
      // Fewer threads carry out the same jobs.
    } catch (const std::bad_alloc&) {
    }
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      if (is_wakeful_ && !is_needed()) {
        ++awake_;
        lock.unlock();
        wait_briefly([this] { return is_needed(); });
        lock.lock();
        --awake_;
      }
      work_.wait(lock, [this] { return is_needed(); });
      if (is_stopped_) return;
      --vacancies_;
      ++working_;
      Batch* batch = batch_;
      lock.unlock();
      batch->work();
      lock.lock();
      if (--working_ == 0) done_.notify_one();
    }
  }

  bool is_needed() const { return is_stopped_ || vacancies_ > 0; }

  const pid_t process_ = getpid();
  const std::size_t available_ = available_threads();
  std::atomic<bool> is_busy_{false};
  std::vector<std::thread> workers_;  // changed only by the thread that has set `is_busy_`
  std::mutex mutex_;                  // guards changes of the members below
  std::condition_variable work_, done_;
  Batch* batch_ = nullptr;
  std::atomic<std::size_t> vacancies_{0};  // workers that may still join the batch
  std::atomic<std::size_t> working_{0};
  std::atomic<bool> is_stopped_{false};
  std::size_t awake_ = 0;            // workers that wait actively
  bool is_wakeful_ = false;          // whether workers do so when they have ended their work
  SteadyClock::time_point ended_{};  // end of the last batch
};

ThreadPool::~ThreadPool() { stop(); }

void ThreadPool::stop() {
  Crew* crew = crew_.exchange(nullptr);
  // After a fork, the threads of the parent process do not exist in this process, and the locks of
  // their crew may never be released. Such a crew is not destroyed.
  if (crew != nullptr && crew->is_of_this_process()) delete crew;
}

ThreadPool::Crew& ThreadPool::crew() {
  Crew* known = crew_.load();
  while (known == nullptr || !known->is_of_this_process()) {
    auto made = std::make_unique<Crew>();
    if (crew_.compare_exchange_strong(known, made.get())) return *made.release();
  }
  return *known;
}

void ThreadPool::parallel_for(std::size_t jobs, std::size_t num_threads, Job job) {
  start(jobs, num_threads, std::move(job))->finish();
}

std::unique_ptr<ThreadPool::Work> ThreadPool::start(std::size_t jobs, std::size_t num_threads,
                                                    Job job) {
  std::unique_ptr<Work> work(new Work(jobs, std::move(job)));
  if (jobs > 1 && num_threads != 1) {
    Crew& workers = crew();
    if (num_threads == 0) num_threads = workers.available();
    const std::size_t threads = std::min({num_threads, jobs, kMaxThreads});
    if (threads > 1 && workers.try_begin(*work->batch_, threads - 1)) work->crew_ = &workers;
  }
  return work;
}

ThreadPool::Work::Work(std::size_t jobs, Job job)
    : batch_(std::make_unique<Batch>(jobs, std::move(job))) {}

ThreadPool::Work::~Work() { complete(); }

void ThreadPool::Work::finish() {
  if (is_complete_) return;
  complete();
  batch_->rethrow();
}

void ThreadPool::Work::complete() {
  if (std::exchange(is_complete_, true)) return;
  batch_->work();
  if (crew_ != nullptr) crew_->end();
}

}  // namespace flatland
