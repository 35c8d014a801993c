// Materials: the effects of surfaces on the beams of range finders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace flatland {

// Replaces the random word of a ray by its random word at a fixture, which depends on the number of
// the fixture, by the finalizer of MurmurHash3 (A. Appleby). The finalizer is a permutation in
// which each input bit changes each output bit with a probability of about 1/2. `Words` may be a
// vector, which is passed by reference because the function is compiled for any instruction set.
template <typename Words>
inline __attribute__((always_inline)) void mix_fixture(Words& word, std::uint32_t fixture) {
  // Multiples of this odd number differ in many bits for successive fixtures.
  word ^= fixture * 0x9E3779B9U + 0x7F4A7C15U;
  word ^= word >> 16U;
  word *= 0x85EBCA6BU;
  word ^= word >> 13U;
  word *= 0xC2B2AE35U;
  word ^= word >> 16U;
}

// All numbers are shares from 0 to 1. The sum of `transmission` and `specular` is at most 1.
struct Material {
  float reflectance = 0.5F;   // share of the light that is scattered, the albedo
  float transmission = 0.0F;  // share of the beams that pass
  float specular = 0.0F;      // share of the beams that are reflected as by a mirror
};

// A material in the form that scans need: limits of random words.
struct Optics {
  static constexpr std::uint32_t kOpaque = 0;
  static constexpr std::uint32_t kInvisible = 0xFFFFFFFFU;

  // A beam passes if its random word is below this limit: kOpaque for no beam, kInvisible for all.
  std::uint32_t pass_limit = kOpaque;
  // A beam that does not pass is reflected as by a mirror if the material is a mirror and the
  // random word is at most this number.
  std::uint32_t last_reflected = 0;
  bool is_mirror = false;
  float reflectance = Material().reflectance;
};

// The materials of the fixtures of a world, by the slots of the ids of fixtures.
class Materials {
 public:
  bool is_empty() const { return count_ == 0; }
  // Returns whether a material that reflects beams was set since the last time at which there were
  // no materials.
  bool has_mirrors() const { return has_mirrors_; }
  // Returns the same for materials that need the random words of rays.
  bool needs_words() const { return needs_words_; }

  void set(std::uint32_t slot, const Material& material);
  void erase(std::uint32_t slot);
  void clear() { *this = Materials(); }

  // Returns the number of the material of a fixture, 0 for a fixture without a material.
  std::uint16_t number_of(std::uint32_t slot) const {
    return slot < numbers_.size() ? numbers_[slot] : std::uint16_t{0};
  }
  // Returns the material with a number; 0 is the number of the default material.
  const Material& at(std::uint16_t number) const { return entries_[number]; }

  // The numbers of materials by slot, and the optics by number.
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
