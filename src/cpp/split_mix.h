// The random numbers of the core that do not belong to a range finder: functions of a key and of
// counters, so that they depend neither on the order in which they are drawn nor on other draws.
#pragma once

#include <cstdint>

namespace flatland {

// The increment of SplitMix64: 2^64 divided by the golden ratio, made odd.
inline constexpr std::uint64_t kSplitMixStep = 0x9E3779B97F4A7C15ULL;

// Returns the next output of SplitMix64 in the state z: G. Steele, D. Lea and C. Flood, "Fast
// splittable pseudorandom number generators", OOPSLA (2014).
inline std::uint64_t split_mix(std::uint64_t z) {
  z += kSplitMixStep;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

}  // namespace flatland
