// A bounding-volume tree of circles and polygons for several scans of one moment.
#pragma once

#include <cstddef>
#include <vector>

#include "rays/edge_tree.h"

class b2Fixture;

namespace flatland {

// It is built in about 50 ns per fixture, in contrast to the trees of edges, which last longer.
class SolidTree {
 public:
  SolidTree() = default;
  explicit SolidTree(const std::vector<b2Fixture*>& solids);

  bool is_empty() const { return solids_.empty(); }
  // The first node is the root. A leaf is the index of the first of up to 8 solids, divided by 8.
  const std::vector<EdgeTree::Node>& nodes() const { return nodes_; }
  // The solids of the leaves.
  const std::vector<b2Fixture*>& solids() const { return solids_; }
  // Solids without a finite bounding box.
  const std::vector<b2Fixture*>& loose() const { return loose_; }

 private:
  std::vector<EdgeTree::Node> nodes_;
  std::vector<b2Fixture*> solids_, loose_;
};

}  // namespace flatland
