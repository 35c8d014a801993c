// Vectors of rays for the instruction sets of x86; see simd.h. Each set is enabled only for its
// members, which can be inlined only into functions that are compiled for it.
#pragma once

#include <immintrin.h>

#include "rays/simd.h"

#pragma GCC push_options
#pragma GCC target("avx2")
namespace flatland::simd {

struct Lanes8Avx2 : Lanes8 {
  static FLATLAND_INLINE std::uint32_t bits(Ints lanes) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(lanes)));
  }
  static FLATLAND_INLINE bool any(Mask mask) {
    return _mm256_movemask_ps(reinterpret_cast<__m256>(mask)) != 0;
  }
};

}  // namespace flatland::simd
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw")
namespace flatland::simd {

// Intrinsics, because the compiler does not vectorize comparisons of generic vectors of this size.
struct Lanes16 {
  static constexpr std::int32_t kWidth = 16;
  using Floats = __m512;
  using Mask = std::uint16_t;

  static FLATLAND_INLINE Floats load(const float* p) { return _mm512_loadu_ps(p); }
  static FLATLAND_INLINE void store(float* p, Floats v) { _mm512_storeu_ps(p, v); }
  static FLATLAND_INLINE Floats broadcast(float x) { return _mm512_set1_ps(x); }
  static FLATLAND_INLINE Floats min(Floats a, Floats b) {
    return _mm512_maskz_min_ps(0xFFFF, a, b);
  }
  static FLATLAND_INLINE Floats max(Floats a, Floats b) {
    return _mm512_maskz_max_ps(0xFFFF, a, b);
  }
  static FLATLAND_INLINE Floats sqrt(Floats a) { return _mm512_maskz_sqrt_ps(0xFFFF, a); }
  static FLATLAND_INLINE Mask less(Floats a, Floats b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
  }
  static FLATLAND_INLINE Mask less_equal(Floats a, Floats b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ);
  }
  static FLATLAND_INLINE Mask equal(Floats a, Floats b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ);
  }
  static FLATLAND_INLINE Mask not_equal(Floats a, Floats b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_NEQ_UQ);
  }
  static FLATLAND_INLINE Mask none() { return 0; }
  static FLATLAND_INLINE Mask both(Mask a, Mask b) { return static_cast<Mask>(a & b); }
  static FLATLAND_INLINE Mask either(Mask a, Mask b) { return static_cast<Mask>(a | b); }
  static FLATLAND_INLINE Mask but_not(Mask a, Mask b) { return static_cast<Mask>(a & ~b); }
  static FLATLAND_INLINE Floats select(Mask mask, Floats a, Floats b) {
    return _mm512_mask_blend_ps(mask, b, a);
  }
  static FLATLAND_INLINE Mask range(std::int32_t begin, std::int32_t end) {
    const std::uint32_t from = begin <= 0 ? 0xFFFFU : 0xFFFFU << (begin < 16 ? begin : 16);
    const std::uint32_t to = end >= 16 ? 0xFFFFU : (1U << (end > 0 ? end : 0)) - 1U;
    return static_cast<Mask>(from & to);
  }
  static FLATLAND_INLINE std::uint32_t bits(Ints lanes) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(lanes)));
  }
  static FLATLAND_INLINE bool any(Mask mask) { return mask != 0; }
};

}  // namespace flatland::simd
#pragma GCC pop_options
