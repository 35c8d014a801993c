// Memory of scans that later scans use again.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

namespace flatland {

struct ScanMemory;

// Memory that is not in use. Thread-safe.
class ScanMemoryPool {
 public:
  ScanMemoryPool();
  ~ScanMemoryPool();

  std::unique_ptr<ScanMemory> take();
  void give_back(std::unique_ptr<ScanMemory> memory);

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<ScanMemory>> unused_;
};

}  // namespace flatland
