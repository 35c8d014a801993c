// A tree of circles and polygons for scans at one moment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rays/edge_tree.h"

class b2Fixture;
struct b2AABB;

namespace flatland {

// Up to 8 circles and polygons with bounding boxes, which are enlarged like the boxes in the broad
// phase of Box2D. Unused entries repeat the last solid.
struct SolidGroup {
  // Creates a group of up to 8 solids. The box of a circle can be too small: due to rounding, Box2D
  // can report a hit outside of the box.
  SolidGroup(b2Fixture* const* solids, std::size_t count);

  float min_x[EdgeTree::kFanOut], min_y[EdgeTree::kFanOut];
  float max_x[EdgeTree::kFanOut], max_y[EdgeTree::kFanOut];
  b2Fixture* solids[EdgeTree::kFanOut];
  std::uint32_t count;
};

// A tree of solids is valid for one moment, unlike the trees of edges. Creating the tree takes
// about 50 ns per fixture.
class SolidTree {
 public:
  // Creates a tree, or only a list of loose solids, which takes much less time.
  SolidTree(const std::vector<b2Fixture*>& solids, bool has_nodes);

  bool is_empty() const { return nodes_.empty() && loose_.empty(); }
  // The first node is the root. A leaf is the index of a group.
  const std::vector<EdgeTree::Node>& nodes() const { return nodes_; }
  const std::vector<SolidGroup>& groups() const { return groups_; }
  // Solids that are not in the tree: all solids, or the solids without a finite bounding box.
  const std::vector<SolidGroup>& loose() const { return loose_; }

 private:
  void build(std::vector<b2Fixture*> solids, const b2AABB& bounds);

  std::vector<EdgeTree::Node> nodes_;
  std::vector<SolidGroup> groups_, loose_;
};

}  // namespace flatland
