// Random numbers for vectors of counters. This file is included once for each instruction set, in a
// namespace with a type `Lanes` (see simd.h); the results of all of them are the same.

// Four random words for each counter, by the generator Philox4x32-10: J. Salmon, M. Moraes, R. Dror
// and D. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011). The first word of the
// counter of a lane is `first + lane`.
struct RandomWords {
  using Words = Lanes::Words;

  Words word[4];

  FLATLAND_INLINE RandomWords(const NoiseKey& noise_key, std::uint32_t first,
                              std::uint32_t attempt) {
    Words c0 = Lanes::count_from(first);
    Words c1 = Lanes::words(attempt);
    Words c2 = Lanes::words(static_cast<std::uint32_t>(noise_key.update));
    Words c3 = Lanes::words(static_cast<std::uint32_t>(noise_key.update >> 32U));
    auto key0 = static_cast<std::uint32_t>(noise_key.stream);
    auto key1 = static_cast<std::uint32_t>(noise_key.stream >> 32U);
    constexpr int kRounds = 10;
    for (int round = 0; round < kRounds; ++round) {
      Words high0, low0, high1, low1;
      Lanes::multiply(c0, 0xD2511F53U, high0, low0);
      Lanes::multiply(c2, 0xCD9E8D57U, high1, low1);
      c0 = high1 ^ c1 ^ key0;
      c1 = low1;
      c2 = high0 ^ c3 ^ key1;
      c3 = low0;
      key0 += 0x9E3779B9U;
      key1 += 0xBB67AE85U;
    }
    word[0] = c0;
    word[1] = c1;
    word[2] = c2;
    word[3] = c3;
  }
};

// -ln(u) for u in (0, 1] with 31 random bits, an exponentially distributed number up to 22. The
// error is below 3e-7 of the number plus 1e-7.
FLATLAND_INLINE Lanes::Floats exponential(Lanes::Words random) {
  using Floats = Lanes::Floats;
  using Words = Lanes::Words;
  // u = x / 2^31 and x = m * 2^e with m from sqrt(1/2) to sqrt(2).
  const Floats x = Lanes::to_floats(Lanes::as_ints(random >> 1U)) + 0.5F;
  constexpr std::uint32_t kRootHalf = 0x3F3504F3U;  // sqrt(1/2) as a float
  const Words shifted = Lanes::as_words(x) - kRootHalf;
  const Floats e = Lanes::to_floats(Lanes::as_ints(shifted) >> 23);
  const Floats m = Lanes::as_floats((shifted & 0x007FFFFFU) + kRootHalf);
  // ln(m) = 2 artanh(s); the next term of the series is less than 1e-9.
  const Floats s = (m - 1.0F) / (m + 1.0F);
  const Floats ss = s * s;
  const Floats series = (((ss * (1.0F / 9.0F) + 1.0F / 7.0F) * ss + 0.2F) * ss + 1.0F / 3.0F) * ss;
  constexpr float kLn2 = 0.693147181F;
  return (31.0F - e) * kLn2 - (s + s * series) * 2.0F;
}

// Two independent standard normal numbers from two random words, up to 6.6 in magnitude, by the
// method of Box and Muller. The absolute error is below 2e-6, except near 0, where the error is the
// root of the error of an exponential number.
struct NormalPair {
  Lanes::Floats first, second;

  FLATLAND_INLINE NormalPair(Lanes::Words radius_bits, Lanes::Words angle_bits) {
    using Floats = Lanes::Floats;
    using Words = Lanes::Words;
    const Floats radius = Lanes::sqrt(exponential(radius_bits) * 2.0F);
    // The angle is a number of quadrants and a rest x from -pi/4 to pi/4.
    const Words quadrants = (angle_bits + 0x20000000U) >> 30U;
    const Words rest = angle_bits - (quadrants << 30U);
    constexpr float kTurn = 6.28318531F / 4294967296.0F;
    const Floats x = Lanes::to_floats(Lanes::as_ints(rest)) * kTurn;
    const Floats xx = x * x;
    const Floats sine =
        x +
        x * xx *
            (((xx * (1.0F / 362880.0F) - 1.0F / 5040.0F) * xx + 1.0F / 120.0F) * xx - 1.0F / 6.0F);
    const Floats cosine =
        (((xx * (1.0F / 40320.0F) - 1.0F / 720.0F) * xx + 1.0F / 24.0F) * xx - 0.5F) * xx + 1.0F;
    // Odd quadrants exchange sine and cosine; the signs depend on the quadrant.
    const Words exchange = Words{} - (quadrants & 1U);
    const Words changed = (Lanes::as_words(sine) ^ Lanes::as_words(cosine)) & exchange;
    const Words cosine_sign = ((quadrants + 1U) & 2U) << 30U;
    const Words sine_sign = (quadrants & 2U) << 30U;
    first = radius * Lanes::as_floats((Lanes::as_words(cosine) ^ changed) ^ cosine_sign);
    second = radius * Lanes::as_floats((Lanes::as_words(sine) ^ changed) ^ sine_sign);
  }
};
