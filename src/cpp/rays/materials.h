// What surfaces do to the beams of range finders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace flatland {

// The random word of a ray at a fixture, from the word of the ray and the number of the fixture:
// one for each pair, by the finalizer of MurmurHash3 (A. Appleby), which is a permutation whose
// every input bit changes each output bit with a probability of about 1/2. For vectors of words,
// too.
template <typename Words>
inline __attribute__((always_inline)) Words fate_word(Words word, std::uint32_t fixture) {
  // Multiples of this odd number differ in many bits for successive fixtures.
  word ^= fixture * 0x9E3779B9U + 0x7F4A7C15U;
  word ^= word >> 16U;
  word *= 0x85EBCA6BU;
  word ^= word >> 13U;
  word *= 0xC2B2AE35U;
  word ^= word >> 16U;
  return word;
}

// Shares from 0 to 1. The sum of `transmission` and `specular` is at most 1.
struct Material {
  float reflectance = 0.5F;   // of the light that is scattered, the albedo
  float transmission = 0.0F;  // beams that pass
  float specular = 0.0F;      // beams that are reflected as by a mirror
};

// A material as rays meet it: limits of random words.
struct Optics {
  static constexpr std::uint32_t kOpaque = 0;
  static constexpr std::uint32_t kInvisible = 0xFFFFFFFFU;

  // A beam passes if its random word is below this limit: kOpaque for no beam, kInvisible for all.
  std::uint32_t pass_limit = kOpaque;
  // A beam that does not pass is reflected as by a mirror if its random word is at most this one
  // and the material is a mirror.
  std::uint32_t last_reflected = 0;
  bool is_mirror = false;
  float reflectance = Material().reflectance;
};

// The materials of the fixtures of a world that have one, by the slots of their ids.
class Materials {
 public:
  bool is_empty() const { return count_ == 0; }
  // Whether a material is in use, or was since there were no materials, that reflects beams.
  bool has_mirrors() const { return has_mirrors_; }
  // Whether random words of rays are needed, as above.
  bool needs_words() const { return needs_words_; }

  void set(std::uint32_t slot, const Material& material);
  void erase(std::uint32_t slot);
  void clear() { *this = Materials(); }

  // Number of the material of a fixture, 0 if it has none.
  std::uint16_t number_of(std::uint32_t slot) const {
    return slot < numbers_.size() ? numbers_[slot] : std::uint16_t{0};
  }
  // The material with a number; 0 is that of fixtures without one.
  const Material& at(std::uint16_t number) const { return entries_[number]; }

  // The numbers by slot, and what they stand for by number.
  const std::vector<std::uint16_t>& numbers() const { return numbers_; }
  const std::vector<Optics>& optics() const { return optics_; }

 private:
  std::uint16_t number(const Material& material);

  std::vector<Material> entries_{Material{}};
  std::vector<Optics> optics_{Optics{}};
  std::vector<std::uint16_t> numbers_;
  std::size_t count_ = 0;
  bool has_mirrors_ = false;
  bool needs_words_ = false;
};

}  // namespace flatland
