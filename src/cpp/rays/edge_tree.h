// A bounding-volume tree for casting rays at the edges of bodies with a common frame. A tree is
// immutable, contains coordinates in this frame, and does not refer to a world.
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
  std::uint16_t coincident_bits = 0;  // categories of a coincident edge; 0 if there is none
  std::uint16_t material = 0;         // number of the material; see Materials
  // Slots of the fixtures of this edge and of the coincident one.
  std::uint32_t fixture = 0;
  std::uint32_t coincident_fixture = 0;
};

// Removes duplicate edges, and merges two coincident edges with different categories into one edge:
// the layers of a world often have most of their walls in common. Coincident edges with different
// materials remain.
void merge_coincident(std::vector<TreeEdge>& edges);

class EdgeTree {
 public:
  static constexpr std::size_t kFanOut = 8;
  // Maximum length of a path from the root.
  static constexpr std::size_t kMaxDepth = 48;

  // Up to 8 edges; unused entries repeat the last edge.
  struct Leaf {
    float x1[kFanOut], y1[kFanOut], x2[kFanOut], y2[kFanOut];
    float normal_x[kFanOut], normal_y[kFanOut];  // computed like in Box2D
    std::uint16_t category_bits[kFanOut], coincident_bits[kFanOut];
    std::uint16_t count;
    std::uint16_t common_bits;  // categories that all edges have
  };

  // Slots of the fixtures of a leaf and numbers of their materials. They are not part of `Leaf`,
  // because most scans do not need them.
  struct LeafFixtures {
    std::uint32_t fixture[kFanOut], coincident[kFanOut];
    std::uint16_t material[kFanOut];
    bool has_materials = false;
    bool has_coincident = false;
  };

  // Up to 8 children, each a node or a leaf, with their bounding boxes.
  struct Node {
    float min_x[kFanOut], min_y[kFanOut], max_x[kFanOut], max_y[kFanOut];
    std::uint32_t child[kFanOut];          // index of a node, or kLeafBit + index of a leaf
    std::uint16_t category_bits[kFanOut];  // of all edges in the subtree
    std::uint32_t count = 0;
  };
  static constexpr std::uint32_t kLeafBit = 0x80000000U;

  explicit EdgeTree(std::vector<TreeEdge> edges);

  // The first node is the root; a tree without edges has no nodes.
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  const std::vector<LeafFixtures>& leaf_fixtures() const { return leaf_fixtures_; }
  std::uint16_t category_bits() const { return category_bits_; }

 private:
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
  std::vector<LeafFixtures> leaf_fixtures_;
  std::uint16_t category_bits_ = 0;

  friend class EdgeTreeBuilder;
};

}  // namespace flatland
