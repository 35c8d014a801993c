// Tests of the random numbers of rays/random_kernel.h, which ends with an error message and status
// 1 if one fails.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>

#include "rays/range_noise.h"
#include "rays/simd.h"

namespace {

using flatland::NoiseKey;
namespace simd = flatland::simd;

namespace single {
using Lanes = simd::Lanes1;
#include "rays/random_kernel.h"
}  // namespace single

namespace vector {
using Lanes = simd::Lanes8;
#include "rays/random_kernel.h"
}  // namespace vector

void require(bool condition, const std::string& what) {
  if (condition) return;
  std::cerr << what << std::endl;
  std::_Exit(1);
}

// The known answers that the authors of Philox publish with their implementation.
void test_known_answers() {
  struct Answer {
    std::uint32_t counter[4], key[2], words[4];
  };
  const Answer answers[] = {
      {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5U, 0xe169c58dU, 0xbc57ac4cU, 0x9b00dbd8U}},
      {{0xffffffffU, 0xffffffffU, 0xffffffffU, 0xffffffffU},
       {0xffffffffU, 0xffffffffU},
       {0x408f276dU, 0x41c83b0eU, 0xa20bc7c6U, 0x6d5451fdU}},
      {{0x243f6a88U, 0x85a308d3U, 0x13198a2eU, 0x03707344U},
       {0xa4093822U, 0x299f31d0U},
       {0xd16cfe09U, 0x94fdccebU, 0x5001e420U, 0x24126ea1U}},
  };
  for (const Answer& answer : answers) {
    const NoiseKey key{std::uint64_t{answer.key[1]} << 32U | answer.key[0],
                       std::uint64_t{answer.counter[3]} << 32U | answer.counter[2]};
    const single::RandomWords words(key, answer.counter[0], answer.counter[1]);
    for (int i = 0; i < 4; ++i) {
      require(words.word[i] == answer.words[i], "a word is not that of Philox4x32-10");
    }
  }
}

void test_vectors_equal_single_numbers() {
  const NoiseKey key{0x0123456789abcdefU, 77};
  for (std::uint32_t first = 0; first < 4096; first += 8) {
    const vector::RandomWords words(key, first, 3);
    const vector::NormalPair normals(words.word[0], words.word[1]);
    for (std::uint32_t lane = 0; lane < 8; ++lane) {
      const single::RandomWords word(key, first + lane, 3);
      for (int i = 0; i < 4; ++i) {
        require(words.word[i][lane] == word.word[i], "words depend on the vector");
      }
      const single::NormalPair normal(word.word[0], word.word[1]);
      require(normals.first[lane] == normal.first && normals.second[lane] == normal.second,
              "normal numbers depend on the vector");
    }
  }
}

void require_accurate(std::uint32_t radius_bits, std::uint32_t angle_bits) {
  const double u = (static_cast<double>(radius_bits >> 1U) + 0.5) / 2147483648.0;
  const double exponential = -std::log(u);
  const double found = static_cast<double>(single::exponential(radius_bits));
  require(found >= 0.0, "an exponential number is negative");
  // Near u = 1 the error is that of u as a float.
  require(std::abs(found - exponential) <= 3e-7 * exponential + 1e-7, "an exponential is wrong");
  constexpr double kTurn = 6.283185307179586476925 / 4294967296.0;
  const double radius = std::sqrt(2.0 * exponential);
  const double angle = kTurn * static_cast<double>(angle_bits);
  const single::NormalPair pair(radius_bits, angle_bits);
  // Near the centre the error of the radius is the root of that of u.
  const double tolerance = radius > 0.01 ? 1.5e-6 + 1e-7 / radius : 5e-4;
  require(std::abs(static_cast<double>(pair.first) - radius * std::cos(angle)) < tolerance,
          "the first normal number is wrong");
  require(std::abs(static_cast<double>(pair.second) - radius * std::sin(angle)) < tolerance,
          "the second normal number is wrong");
}

void test_accuracy() {
  const std::uint32_t extremes[] = {0,           1,           2,           3,           0x1fffffffU,
                                    0x20000000U, 0x3fffffffU, 0x5fffffffU, 0x60000000U, 0x7fffffffU,
                                    0x80000000U, 0x9fffffffU, 0xa0000000U, 0xdfffffffU, 0xe0000000U,
                                    0xfffffffeU, 0xffffffffU};
  for (const std::uint32_t radius : extremes) {
    for (const std::uint32_t angle : extremes) require_accurate(radius, angle);
  }
  for (std::uint32_t first = 0; first < 1000000; ++first) {
    const single::RandomWords words({5, 6}, first, 0);
    require_accurate(words.word[0], words.word[1]);
    // Small u, in the tails of the distribution.
    require_accurate(words.word[2] >> (words.word[3] % 32U), words.word[1]);
  }
}

}  // namespace

int main() {
  test_known_answers();
  test_vectors_equal_single_numbers();
  test_accuracy();
  return 0;
}
