// Uniform and normal random numbers, as functions of a key and of counters.
#pragma once

#include <cmath>
#include <cstdint>

#include "angles.h"
#include "split_mix.h"
#include "vec.h"

namespace flatland::crowd {

// Returns a number from 0 to less than 1.
inline double uniform(std::uint64_t key, std::uint64_t stream, std::uint64_t counter) {
  const std::uint64_t word = split_mix(split_mix(split_mix(key) ^ stream) ^ counter);
  return static_cast<double>(word >> 11U) * 0x1p-53;
}

// Returns two independent standard normal numbers, by the Box-Muller transform. The function uses
// the values `counter` and `counter + 1` of the counter.
inline Vec normal(std::uint64_t key, std::uint64_t stream, std::uint64_t counter) {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(key, stream, counter)));
  const double angle = kTwoPi * uniform(key, stream, counter + 1);
  return radius * Vec{std::cos(angle), std::sin(angle)};
}

}  // namespace flatland::crowd
