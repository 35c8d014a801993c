// The edges of bodies with a common frame in a bounding-volume tree for ray casting. Built once,
// never changed, in that frame and without any pointer into a world, so that worlds may share it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace flatland {

struct TreeEdge {
  float x1, y1, x2, y2;
  std::uint16_t category_bits;
  std::uint16_t twin_bits = 0;  // categories of another edge at the same place, 0 for none
};

// Drops edges that repeat another one in place and category, and puts two that differ in their
// category only into one: two layers of a world often share most of their walls.
void merge_twins(std::vector<TreeEdge>& edges);

class EdgeTree {
 public:
  static constexpr std::size_t kFanOut = 8;
  // No path from the root is longer.
  static constexpr std::size_t kMaxDepth = 48;

  // Up to 8 edges; unused places repeat the last edge.
  struct Leaf {
    float x1[kFanOut], y1[kFanOut], x2[kFanOut], y2[kFanOut];
    float normal_x[kFanOut], normal_y[kFanOut];  // as Box2D computes it
    std::uint16_t category_bits[kFanOut], twin_bits[kFanOut];
    std::uint32_t count;
  };

  // Up to 8 children, each a node or a leaf, with the boxes around them.
  struct Node {
    float min_x[kFanOut], min_y[kFanOut], max_x[kFanOut], max_y[kFanOut];
    std::uint32_t child[kFanOut];          // kLeafBit + index of a leaf, or index of a node
    std::uint16_t category_bits[kFanOut];  // of all edges below
    std::uint32_t count = 0;
  };
  static constexpr std::uint32_t kLeafBit = 0x80000000U;

  explicit EdgeTree(std::vector<TreeEdge> edges);

  // The root is the first node; a tree of no edges has none.
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  std::uint16_t category_bits() const { return category_bits_; }

 private:
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
  std::uint16_t category_bits_ = 0;

  friend class EdgeTreeBuilder;
};

}  // namespace flatland
