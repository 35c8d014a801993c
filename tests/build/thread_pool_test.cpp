// Tests of flatland::ThreadPool. The name of a test is the argument of the program, which ends with
// an error message and status 1 if the test fails.
#include "parallel/thread_pool.h"

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using flatland::ThreadPool;

void require(bool condition, const std::string& what) {
  if (condition) return;
  std::cerr << what << std::endl;
  std::_Exit(1);
}

// Calls a pool and requires that each job is carried out exactly once.
void run_each_once(ThreadPool& pool, std::size_t jobs, std::size_t threads) {
  std::vector<std::atomic<int>> calls(jobs);
  pool.parallel_for(jobs, threads, [&](std::size_t i) { ++calls[i]; });
  for (const auto& count : calls) require(count == 1, "a job was not carried out once");
}

// Jobs wait for each other, so that the call returns only if `threads` threads take part.
std::set<std::thread::id> meet(ThreadPool& pool, std::size_t threads) {
  std::mutex mutex;
  std::condition_variable arrived;
  std::set<std::thread::id> found;
  pool.parallel_for(threads, threads, [&](std::size_t) {
    std::unique_lock<std::mutex> lock(mutex);
    found.insert(std::this_thread::get_id());
    arrived.notify_all();
    arrived.wait(lock, [&] { return found.size() == threads; });
  });
  return found;
}

void test_each_job_once() {
  ThreadPool pool;
  for (const std::size_t jobs : {0, 1, 2, 3, 1000}) {
    for (const std::size_t threads : {0, 1, 2, 7, 1000}) run_each_once(pool, jobs, threads);
  }
}

void test_threads() {
  ThreadPool pool;
  const std::set<std::thread::id> first = meet(pool, 3);
  require(first.size() == 3, "three threads did not take part");
  require(first.count(std::this_thread::get_id()) == 1, "the caller did not take part");
  require(meet(pool, 3) == first, "workers were not used again");
  require(meet(pool, 5).size() == 5, "no further workers were started");
}

void test_one_thread() {
  ThreadPool pool;
  const std::thread::id caller = std::this_thread::get_id();
  std::size_t next = 0;
  pool.parallel_for(100, 1, [&](std::size_t i) {
    require(std::this_thread::get_id() == caller, "another thread took part");
    require(i == next++, "jobs were not carried out in order");
  });
}

void test_exceptions() {
  ThreadPool pool;
  for (const std::size_t threads : {1, 4}) {
    std::atomic<int> calls{0};
    std::string message;
    try {
      pool.parallel_for(100, threads, [&](std::size_t i) {
        ++calls;
        if (i % 10 == 3) throw std::runtime_error("job " + std::to_string(i));
      });
    } catch (const std::runtime_error& error) {
      message = error.what();
    }
    require(message == "job 3", "raised '" + message + "' and not that of the first job");
    require(calls == 100, "an exception prevented other jobs");
    run_each_once(pool, 100, threads);
  }
}

void test_nested_and_concurrent_calls() {
  ThreadPool pool;
  std::atomic<int> calls{0};
  pool.parallel_for(8, 4,
                    [&](std::size_t) { pool.parallel_for(8, 4, [&](std::size_t) { ++calls; }); });
  require(calls == 64, "nested jobs were lost");
  std::vector<std::thread> callers;
  for (int i = 0; i < 4; ++i) {
    callers.emplace_back([&] {
      for (int repeat = 0; repeat < 200; ++repeat) run_each_once(pool, 20, 3);
    });
  }
  for (std::thread& caller : callers) caller.join();
}

void test_stop() {
  ThreadPool pool;
  pool.stop();
  for (int i = 0; i < 3; ++i) {
    require(meet(pool, 2).size() == 2, "a stopped pool has no workers");
    pool.stop();
  }
}

// Workers are awake, asleep, or about to fall asleep when a call begins. All of them must come.
void test_pauses() {
  ThreadPool pool;
  for (int i = 0; i < 300; ++i) {
    meet(pool, 3);
    const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(i * 37 % 300);
    while (std::chrono::steady_clock::now() < end) std::this_thread::yield();
    if (i % 50 == 49) pool.stop();
  }
}

void test_idle_workers_sleep() {
  ThreadPool pool;
  for (int i = 0; i < 100; ++i) meet(pool, 3);
  const std::clock_t before = std::clock();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const double used = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  require(used < 0.1, "idle workers use processor time: " + std::to_string(used) + " s");
}

void test_fork() {
  ThreadPool pool;
  meet(pool, 3);
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);  // of the child only
    meet(pool, 3);
    pool.stop();
    meet(pool, 2);
    {
      ThreadPool other;
      meet(other, 2);
    }
    pool.~ThreadPool();
    std::_Exit(0);
  }
  int status = -1;
  require(waitpid(child, &status, 0) == child && status == 0, "the child process failed");
  meet(pool, 3);
}

void test_available() {
  const std::size_t available = flatland::available_threads();
  require(available >= 1, "no thread is available");
  cpu_set_t one;
  CPU_ZERO(&one);
  cpu_set_t all;
  require(sched_getaffinity(0, sizeof(all), &all) == 0, "no affinity");
  require(available <= static_cast<std::size_t>(CPU_COUNT(&all)), "more threads than processors");
  for (std::size_t i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++i) {
    if (CPU_ISSET(i, &all)) CPU_SET(i, &one);
  }
  require(sched_setaffinity(0, sizeof(one), &one) == 0, "the affinity cannot be set");
  require(flatland::available_threads() == 1, "ignores the affinity of the process");
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, void (*)()> tests{
      {"each_job_once", test_each_job_once},
      {"threads", test_threads},
      {"one_thread", test_one_thread},
      {"exceptions", test_exceptions},
      {"nested_and_concurrent_calls", test_nested_and_concurrent_calls},
      {"stop", test_stop},
      {"pauses", test_pauses},
      {"idle_workers_sleep", test_idle_workers_sleep},
      {"fork", test_fork},
      {"available", test_available},
  };
  require(argc == 2 && tests.count(argv[1]) == 1, "usage: thread_pool_test TEST");
  tests.at(argv[1])();
  return 0;
}
