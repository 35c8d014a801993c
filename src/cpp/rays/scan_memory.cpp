#include "rays/scan_memory.h"

#include <utility>

#include "rays/range_finder.h"

namespace flatland {

ScanMemoryPool::ScanMemoryPool() = default;
ScanMemoryPool::~ScanMemoryPool() = default;

std::unique_ptr<ScanMemory> ScanMemoryPool::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (unused_.empty()) return std::make_unique<ScanMemory>();
  std::unique_ptr<ScanMemory> memory = std::move(unused_.back());
  unused_.pop_back();
  return memory;
}

void ScanMemoryPool::give_back(std::unique_ptr<ScanMemory> memory) {
  const std::lock_guard<std::mutex> lock(mutex_);
  unused_.push_back(std::move(memory));
}

}  // namespace flatland
