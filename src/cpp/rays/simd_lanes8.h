// Vectors of eight numbers. Only simd.h and simd_x86.h include this file, once for each instruction
// set in a namespace `simd`: Clang inlines a function with vectors as arguments only into functions
// for the same instruction set.

// Vectors of eight numbers, by the vector extensions of the compiler. An operation is one
// instruction with AVX, and two with SSE2 or NEON.
inline constexpr std::size_t kWidth = 8;

using Floats = float __attribute__((vector_size(32), may_alias));
using Ints = std::int32_t __attribute__((vector_size(32), may_alias));

// The same in arrays of numbers, at any address. In an alias declaration, Clang ignores `aligned`.
typedef float StoredFloats __attribute__((vector_size(32), aligned(4), may_alias));
typedef std::int32_t StoredInts __attribute__((vector_size(32), aligned(4), may_alias));

FLATLAND_INLINE Floats load(const float* p) { return *reinterpret_cast<const StoredFloats*>(p); }
FLATLAND_INLINE void store(float* p, Floats v) { *reinterpret_cast<StoredFloats*>(p) = v; }
FLATLAND_INLINE void store(std::int32_t* p, Ints v) { *reinterpret_cast<StoredInts*>(p) = v; }
FLATLAND_INLINE void store(std::uint32_t* p, Ints v) { *reinterpret_cast<StoredInts*>(p) = v; }
FLATLAND_INLINE Ints load(const std::int32_t* p) { return *reinterpret_cast<const StoredInts*>(p); }
FLATLAND_INLINE Ints load(const std::uint32_t* p) {
  return *reinterpret_cast<const StoredInts*>(p);
}
FLATLAND_INLINE Ints load(const std::uint16_t* p) {
  typedef std::uint16_t Halves __attribute__((vector_size(16), aligned(2), may_alias));
  return __builtin_convertvector(*reinterpret_cast<const Halves*>(p), Ints);
}
FLATLAND_INLINE Floats broadcast(float x) { return Floats{x, x, x, x, x, x, x, x}; }

FLATLAND_INLINE Floats min(Floats a, Floats b) { return a < b ? a : b; }
FLATLAND_INLINE Floats max(Floats a, Floats b) { return a > b ? a : b; }
FLATLAND_INLINE Floats abs(Floats a) { return a < 0.0F ? -a : a; }

FLATLAND_INLINE Ints min(Ints a, Ints b) { return a < b ? a : b; }
FLATLAND_INLINE Ints max(Ints a, Ints b) { return a > b ? a : b; }
FLATLAND_INLINE Ints min(Ints a, std::int32_t b) { return min(a, Ints{} + b); }

// Return the lowest and the highest of eight numbers.
FLATLAND_INLINE std::int32_t lowest(Ints a) {
  a = min(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
  a = min(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
  return a[0] < a[1] ? a[0] : a[1];
}
FLATLAND_INLINE std::int32_t highest(Ints a) {
  a = max(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
  a = max(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
  return a[0] > a[1] ? a[0] : a[1];
}

// Returns the square roots of non-negative numbers.
FLATLAND_INLINE Floats sqrt(Floats a) {
  Floats root;
  for (std::size_t i = 0; i < kWidth; ++i) root[i] = std::sqrt(a[i]);
  return root;
}

// Returns the largest integers not greater than the numbers, which must be in the 32-bit range.
FLATLAND_INLINE Ints floor(Floats a) {
  const Ints truncated = __builtin_convertvector(a, Ints);
  return truncated + (__builtin_convertvector(truncated, Floats) > a);  // true is -1
}

// Returns the diamond angle of (x, y), NaN for (0, 0). It is a monotonic function of the angle that
// needs no trigonometry, and increases from 0 to 4 over the full circle. Opposite directions differ
// by 2.
FLATLAND_INLINE Floats diamond_angle(Floats x, Floats y) {
  const Floats q = y / (abs(x) + abs(y));
  const Floats right = y < 0.0F ? q + 4.0F : q;
  return x < 0.0F ? 2.0F - q : right;
}

// Returns the equivalent difference of diamond angles in [-2, 2].
FLATLAND_INLINE Floats wrap_difference(Floats d) {
  d = d > 2.0F ? d - 4.0F : d;
  return d < -2.0F ? d + 4.0F : d;
}

// Vectors of rays, for any instruction set. Lanes8Avx2 and Lanes16 in simd_x86.h have the same
// members. Comparisons with NaN are false, except for `not_equal`.
struct Lanes8 {
  static constexpr std::int32_t kWidth = 8;
  using Floats = simd::Floats;
  using Mask = simd::Ints;
  using Ints = simd::Ints;
  using Words = std::uint32_t __attribute__((vector_size(32), may_alias));

  static FLATLAND_INLINE Floats to_floats(Ints a) { return __builtin_convertvector(a, Floats); }
  static FLATLAND_INLINE Floats as_floats(Words a) { return reinterpret_cast<Floats>(a); }
  static FLATLAND_INLINE Words as_words(Floats a) { return reinterpret_cast<Words>(a); }
  static FLATLAND_INLINE Ints as_ints(Words a) { return reinterpret_cast<Ints>(a); }
  static FLATLAND_INLINE Words as_words(Ints a) { return reinterpret_cast<Words>(a); }
  static FLATLAND_INLINE Words words(std::uint32_t x) { return Words{} + x; }
  static FLATLAND_INLINE Words count_from(std::uint32_t x) {
    return Words{0, 1, 2, 3, 4, 5, 6, 7} + x;
  }
  static FLATLAND_INLINE void store(std::uint32_t* p, Words v) {
    simd::store(p, reinterpret_cast<simd::Ints>(v));
  }
  static FLATLAND_INLINE void multiply(Words a, std::uint32_t b, Words& high, Words& low) {
    for (std::size_t i = 0; i < simd::kWidth; ++i) {
      const std::uint64_t product = std::uint64_t{a[i]} * b;
      high[i] = static_cast<std::uint32_t>(product >> 32U);
      low[i] = static_cast<std::uint32_t>(product);
    }
  }

  static FLATLAND_INLINE Floats load(const float* p) { return simd::load(p); }
  static FLATLAND_INLINE void store(float* p, Floats v) { simd::store(p, v); }
  static FLATLAND_INLINE Floats broadcast(float x) { return simd::broadcast(x); }
  static FLATLAND_INLINE Floats min(Floats a, Floats b) { return simd::min(a, b); }
  static FLATLAND_INLINE Floats max(Floats a, Floats b) { return simd::max(a, b); }
  static FLATLAND_INLINE Floats sqrt(Floats a) { return simd::sqrt(a); }
  static FLATLAND_INLINE Mask less(Floats a, Floats b) { return a < b; }
  static FLATLAND_INLINE Mask less(Words a, Words b) { return a < b; }
  static FLATLAND_INLINE Mask less_equal(Floats a, Floats b) { return a <= b; }
  static FLATLAND_INLINE Mask equal(Floats a, Floats b) { return a == b; }
  static FLATLAND_INLINE Mask not_equal(Floats a, Floats b) { return a != b; }
  static FLATLAND_INLINE Mask none() { return Mask{}; }
  static FLATLAND_INLINE Mask both(Mask a, Mask b) { return a & b; }
  static FLATLAND_INLINE Mask either(Mask a, Mask b) { return a | b; }
  static FLATLAND_INLINE Mask but_not(Mask a, Mask b) { return a & ~b; }
  static FLATLAND_INLINE Floats select(Mask mask, Floats a, Floats b) { return mask ? a : b; }
  // Returns a mask that is true in the lanes from `begin` to `end` - 1. Both may lie outside of the
  // vector.
  static FLATLAND_INLINE Mask range(std::int32_t begin, std::int32_t end) {
    constexpr Mask kIndex{0, 1, 2, 3, 4, 5, 6, 7};
    return (kIndex >= begin) & (kIndex < end);
  }
  // Returns a number in which bit i is set if lane i of eight integers is true (-1).
  static FLATLAND_INLINE std::uint32_t bits(Ints lanes) {
    const Ints weights = lanes & Ints{1, 2, 4, 8, 16, 32, 64, 128};
    std::int32_t sum = 0;
    for (std::size_t i = 0; i < simd::kWidth; ++i) sum |= weights[i];
    return static_cast<std::uint32_t>(sum);
  }
  static FLATLAND_INLINE bool any(Mask mask) {
    using Longs = std::int64_t __attribute__((vector_size(32)));
    const auto pairs = reinterpret_cast<Longs>(mask);
    return ((pairs[0] | pairs[1]) | (pairs[2] | pairs[3])) != 0;
  }
};
