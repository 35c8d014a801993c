// Arrays for vectors of floats.
#pragma once

#include <cstddef>
#include <vector>

namespace flatland {

// An array of floats at a multiple of 64 bytes. No aligned vector extends over two cache lines, and
// no aligned load overlaps a preceding store only in part, which would be slow.
class AlignedFloats {
 public:
  // Sizes are rounded up to multiples of this number, the width of the widest vectors.
  static constexpr std::size_t kBlock = 16;

  static constexpr std::size_t rounded(std::size_t size) {
    return (size + kBlock - 1) / kBlock * kBlock;
  }

  AlignedFloats() = default;
  explicit AlignedFloats(std::size_t size) { resize(size); }

  // New elements are 0.
  void resize(std::size_t size) { blocks_.resize(rounded(size) / kBlock); }
  std::size_t size() const { return kBlock * blocks_.size(); }
  float* data() { return reinterpret_cast<float*>(blocks_.data()); }
  const float* data() const { return reinterpret_cast<const float*>(blocks_.data()); }
  float& operator[](std::size_t i) { return data()[i]; }
  float operator[](std::size_t i) const { return data()[i]; }

 private:
  struct alignas(kBlock * sizeof(float)) Block {
    float values[kBlock];
  };

  std::vector<Block> blocks_;
};

}  // namespace flatland
