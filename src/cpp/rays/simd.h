// Operations on vectors of floats. Contraction to fused operations is disabled (see
// CMakeLists.txt), so the results are the same on all machines.
//
// All functions are always inlined. They are then compiled for the instruction set of the calling
// function, so the same source serves several instruction sets.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#define FLATLAND_INLINE inline __attribute__((always_inline))

// Functions between FLATLAND_BEGIN_TARGET(features) and FLATLAND_END_TARGET are compiled for an
// instruction set, for example "avx2". GCC and Clang have different pragmas for this purpose.
#define FLATLAND_PRAGMA(...) _Pragma(#__VA_ARGS__)
#if defined(__clang__)
#define FLATLAND_BEGIN_TARGET(features) \
  FLATLAND_PRAGMA(clang attribute push(__attribute__((target(features))), apply_to = function))
#define FLATLAND_END_TARGET FLATLAND_PRAGMA(clang attribute pop)
#else
#define FLATLAND_BEGIN_TARGET(features) \
  FLATLAND_PRAGMA(GCC push_options) FLATLAND_PRAGMA(GCC target(features))
#define FLATLAND_END_TARGET FLATLAND_PRAGMA(GCC pop_options)
#endif

namespace flatland::simd {

#include "rays/simd_lanes8.h"

// A vector of one number: the arithmetic of the other vectors on single numbers.
struct Lanes1 {
  static constexpr std::int32_t kWidth = 1;
  using Floats = float;
  using Ints = std::int32_t;
  using Words = std::uint32_t;

  static FLATLAND_INLINE Floats broadcast(float x) { return x; }
  static FLATLAND_INLINE Floats sqrt(Floats a) { return std::sqrt(a); }
  static FLATLAND_INLINE Floats to_floats(Ints a) { return static_cast<float>(a); }
  static FLATLAND_INLINE Floats as_floats(Words a) { return __builtin_bit_cast(float, a); }
  static FLATLAND_INLINE Words as_words(Floats a) { return __builtin_bit_cast(Words, a); }
  static FLATLAND_INLINE Ints as_ints(Words a) { return static_cast<Ints>(a); }
  static FLATLAND_INLINE Words as_words(Ints a) { return static_cast<Words>(a); }
  static FLATLAND_INLINE Words words(std::uint32_t x) { return x; }
  static FLATLAND_INLINE Words count_from(std::uint32_t x) { return x; }
  // Computes the upper and the lower half of each product.
  static FLATLAND_INLINE void multiply(Words a, std::uint32_t b, Words& high, Words& low) {
    const std::uint64_t product = std::uint64_t{a} * b;
    high = static_cast<Words>(product >> 32U);
    low = static_cast<Words>(product);
  }
};

}  // namespace flatland::simd
