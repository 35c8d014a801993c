// Operations on vectors of eight floats, with the vector extensions of the compiler: one
// instruction with AVX, two with SSE2 or NEON. Contraction to fused operations is disabled (see
// CMakeLists.txt), so the results are the same on all machines.
//
// All functions are always inlined. They are then compiled for the instruction set of the calling
// function, so the same source serves several instruction sets.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#define FLATLAND_INLINE inline __attribute__((always_inline))

namespace flatland::simd {

inline constexpr std::size_t kWidth = 8;

using Floats = float __attribute__((vector_size(32), aligned(4), may_alias));
using Ints = std::int32_t __attribute__((vector_size(32), aligned(4), may_alias));

FLATLAND_INLINE Floats load(const float* p) { return *reinterpret_cast<const Floats*>(p); }
FLATLAND_INLINE void store(float* p, Floats v) { *reinterpret_cast<Floats*>(p) = v; }
FLATLAND_INLINE void store(std::int32_t* p, Ints v) { *reinterpret_cast<Ints*>(p) = v; }
FLATLAND_INLINE Floats broadcast(float x) { return Floats{x, x, x, x, x, x, x, x}; }

// True in the first `count` lanes.
FLATLAND_INLINE Ints first_lanes(std::int32_t count) {
  return Ints{0, 1, 2, 3, 4, 5, 6, 7} < count;
}

FLATLAND_INLINE Floats min(Floats a, Floats b) { return a < b ? a : b; }
FLATLAND_INLINE Floats max(Floats a, Floats b) { return a > b ? a : b; }
FLATLAND_INLINE Floats abs(Floats a) { return a < 0.0F ? -a : a; }

// Square roots of non-negative numbers.
FLATLAND_INLINE Floats sqrt(Floats a) {
  Floats root;
  for (std::size_t i = 0; i < kWidth; ++i) root[i] = std::sqrt(a[i]);
  return root;
}

// Whether any lane is true.
FLATLAND_INLINE bool any(Ints v) {
  using Longs = std::int64_t __attribute__((vector_size(32)));
  const auto pairs = reinterpret_cast<Longs>(v);
  return ((pairs[0] | pairs[1]) | (pairs[2] | pairs[3])) != 0;
}

// Largest integers not greater than the numbers, which must be in the 32-bit range.
FLATLAND_INLINE Ints floor(Floats a) {
  const Ints truncated = __builtin_convertvector(a, Ints);
  return truncated + (__builtin_convertvector(truncated, Floats) > a);  // true is -1
}

// Diamond angle of (x, y): a monotonic function of the angle without trigonometry, from 0 to 4 over
// the full circle. Opposite directions differ by 2. NaN for (0, 0).
FLATLAND_INLINE Floats diamond_angle(Floats x, Floats y) {
  const Floats q = y / (abs(x) + abs(y));
  const Floats right = y < 0.0F ? q + 4.0F : q;
  return x < 0.0F ? 2.0F - q : right;
}

// The equivalent angle difference in [-2, 2].
FLATLAND_INLINE Floats wrap_difference(Floats d) {
  d = d > 2.0F ? d - 4.0F : d;
  return d < -2.0F ? d + 4.0F : d;
}

}  // namespace flatland::simd
