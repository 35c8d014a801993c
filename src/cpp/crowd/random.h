// Random numbers that are functions of a key and of counters, so that they depend neither on the
// order in which they are drawn nor on anything else.
#pragma once

#include <cmath>
#include <cstdint>

#include "angles.h"
#include "crowd/vec.h"

namespace flatland::crowd {

// The output function of SplitMix64: G. Steele, D. Lea and C. Flood, "Fast splittable pseudorandom
// number generators", OOPSLA (2014).
inline std::uint64_t mix(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

// A number from 0 to less than 1.
inline double uniform(std::uint64_t key, std::uint64_t stream, std::uint64_t counter) {
  return static_cast<double>(mix(mix(mix(key) ^ stream) ^ counter) >> 11U) * 0x1p-53;
}

// A vector of two independent standard normal numbers, by the Box-Muller transform; it uses two
// values of the counter.
inline Vec normal(std::uint64_t key, std::uint64_t stream, std::uint64_t counter) {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(key, stream, counter)));
  const double angle = kTwoPi * uniform(key, stream, counter + 1);
  return radius * Vec{std::cos(angle), std::sin(angle)};
}

}  // namespace flatland::crowd
