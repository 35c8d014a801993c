// Circles and polygons, with their bounding boxes, for the scans of one moment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rays/edge_tree.h"

class b2Fixture;
struct b2AABB;

namespace flatland {

// Up to 8 circles and polygons with their bounding boxes, enlarged like those in the broad phase of
// Box2D. Unused entries repeat the last one.
struct SolidGroup {
  // From up to 8 solids. The box of a circle can be too small: due to rounding, Box2D can report a
  // hit outside of it.
  SolidGroup(b2Fixture* const* solids, std::size_t count);

  float min_x[EdgeTree::kFanOut], min_y[EdgeTree::kFanOut];
  float max_x[EdgeTree::kFanOut], max_y[EdgeTree::kFanOut];
  b2Fixture* solids[EdgeTree::kFanOut];
  std::uint32_t count;
};

// It is built in about 50 ns per fixture, in contrast to the trees of edges, which last longer.
class SolidTree {
 public:
  // Without nodes, all solids are loose, which takes much less time.
  SolidTree(const std::vector<b2Fixture*>& solids, bool has_nodes);

  bool is_empty() const { return nodes_.empty() && loose_.empty(); }
  // The first node is the root. A leaf is the index of a group.
  const std::vector<EdgeTree::Node>& nodes() const { return nodes_; }
  const std::vector<SolidGroup>& groups() const { return groups_; }
  // Solids that are not in the tree: those without a finite bounding box, or all.
  const std::vector<SolidGroup>& loose() const { return loose_; }

 private:
  void build(std::vector<b2Fixture*> solids, const b2AABB& bounds);

  std::vector<EdgeTree::Node> nodes_;
  std::vector<SolidGroup> groups_, loose_;
};

}  // namespace flatland
