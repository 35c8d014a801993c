// Vectors of rays for the instruction sets of x86; see simd.h. Each set is enabled only for its
// members, which can be inlined only into functions that are compiled for it.
#pragma once

#include <immintrin.h>

#include "rays/simd.h"

FLATLAND_BEGIN_TARGET("avx2")
namespace flatland::avx2::simd {

#include "rays/simd_lanes8.h"

struct Lanes8Avx2 : Lanes8 {
  static FLATLAND_INLINE void multiply(Words a, std::uint32_t b, Words& high, Words& low) {
    const auto words = reinterpret_cast<__m256i>(a);
    const __m256i factor = _mm256_set1_epi32(static_cast<int>(b));
    const __m256i even = _mm256_mul_epu32(words, factor);
    const __m256i odd = _mm256_mul_epu32(_mm256_srli_epi64(words, 32), factor);
    constexpr int kOdd = 0xAA;
    high = reinterpret_cast<Words>(_mm256_blend_epi32(_mm256_srli_epi64(even, 32), odd, kOdd));
    low = reinterpret_cast<Words>(_mm256_blend_epi32(even, _mm256_slli_epi64(odd, 32), kOdd));
  }
  static FLATLAND_INLINE std::uint32_t bits(simd::Ints lanes) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(lanes)));
  }
  static FLATLAND_INLINE bool any(Mask mask) {
    return _mm256_movemask_ps(reinterpret_cast<__m256>(mask)) != 0;
  }
};

}  // namespace flatland::avx2::simd
FLATLAND_END_TARGET

FLATLAND_BEGIN_TARGET("avx512f,avx512vl,avx512dq,avx512bw")
namespace flatland::avx512::simd {

#include "rays/simd_lanes8.h"

// The operations are intrinsics, because the compiler does not vectorize comparisons of generic
// vectors of this size.
struct Lanes16 {
  static constexpr std::int32_t kWidth = 16;
  using Floats = __m512;
  using Mask = std::uint16_t;
  using Ints = std::int32_t __attribute__((vector_size(64), may_alias));
  using Words = std::uint32_t __attribute__((vector_size(64), may_alias));

  static FLATLAND_INLINE Floats to_floats(Ints a) {
    return _mm512_maskz_cvtepi32_ps(0xFFFF, reinterpret_cast<__m512i>(a));
  }
  static FLATLAND_INLINE Floats as_floats(Words a) { return reinterpret_cast<Floats>(a); }
  static FLATLAND_INLINE Words as_words(Floats a) { return reinterpret_cast<Words>(a); }
  static FLATLAND_INLINE Ints as_ints(Words a) { return reinterpret_cast<Ints>(a); }
  static FLATLAND_INLINE Words as_words(Ints a) { return reinterpret_cast<Words>(a); }
  static FLATLAND_INLINE Words words(std::uint32_t x) { return Words{} + x; }
  static FLATLAND_INLINE Words count_from(std::uint32_t x) {
    return Words{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15} + x;
  }
  static FLATLAND_INLINE void store(std::uint32_t* p, Words v) {
    _mm512_storeu_si512(p, reinterpret_cast<__m512i>(v));
  }
  static FLATLAND_INLINE void multiply(Words a, std::uint32_t b, Words& high, Words& low) {
    const auto words = reinterpret_cast<__m512i>(a);
    const __m512i factor = _mm512_set1_epi32(static_cast<int>(b));
    const __m512i even = _mm512_maskz_mul_epu32(0xFF, words, factor);
    const __m512i odd =
        _mm512_maskz_mul_epu32(0xFF, _mm512_maskz_srli_epi64(0xFF, words, 32), factor);
    constexpr __mmask16 kOdd = 0xAAAA;
    high = reinterpret_cast<Words>(
        _mm512_mask_blend_epi32(kOdd, _mm512_maskz_srli_epi64(0xFF, even, 32), odd));
    low = reinterpret_cast<Words>(
        _mm512_mask_blend_epi32(kOdd, even, _mm512_maskz_slli_epi64(0xFF, odd, 32)));
  }

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
  static FLATLAND_INLINE Mask less(Words a, Words b) {
    return _mm512_cmplt_epu32_mask(reinterpret_cast<__m512i>(a), reinterpret_cast<__m512i>(b));
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
  static FLATLAND_INLINE std::uint32_t bits(simd::Ints lanes) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(lanes)));
  }
  static FLATLAND_INLINE bool any(Mask mask) { return mask != 0; }
};

}  // namespace flatland::avx512::simd
FLATLAND_END_TARGET
