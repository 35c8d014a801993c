// Loading data into the cache of the processor ahead of time. None of this has an effect on
// results.
#pragma once

#include <cstddef>
#include <vector>

namespace flatland {

// Begins to load some bytes into the cache.
inline void prefetch(const void* begin, std::size_t size) {
  constexpr std::size_t kLine = 64;
  for (std::size_t i = 0; i < size; i += kLine) {
    __builtin_prefetch(static_cast<const char*>(begin) + i);
  }
}

// Begins to load the first elements of a vector.
template <typename Element>
void prefetch(const std::vector<Element>& vector) {
  constexpr std::size_t kMost = 512;  // bytes
  const std::size_t size = vector.size() * sizeof(Element);
  prefetch(vector.data(), size < kMost ? size : kMost);
}

}  // namespace flatland
