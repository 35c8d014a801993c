#include "rays/solid_tree.h"

#include <box2d/b2_collision.h>
#include <box2d/b2_fixture.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace flatland {
namespace {

constexpr std::size_t kFanOut = EdgeTree::kFanOut;

// A node or leaf of one level.
struct Part {
  b2AABB box;
  std::uint32_t child;
  std::uint16_t category_bits;
};

bool is_finite(const b2AABB& box) {
  // NaN or infinity in any number makes the sum not finite, unless it overflows.
  return std::isfinite(box.lowerBound.x + box.lowerBound.y + box.upperBound.x + box.upperBound.y);
}

// Inserts a zero between the lower 16 bits of a number.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 8U) & 0x00FF00FFU;
  x = (x | x << 4U) & 0x0F0F0F0FU;
  x = (x | x << 2U) & 0x33333333U;
  return (x | x << 1U) & 0x55555555U;
}

// Position of a box along a curve that fills the bounds, such that neighbours on the curve are
// neighbours in space (a Morton code).
std::uint32_t place_of(const b2AABB& box, const b2AABB& bounds) {
  constexpr float kCells = 65535.0F;
  const b2Vec2 offset = box.GetCenter() - bounds.lowerBound;
  const b2Vec2 size = bounds.upperBound - bounds.lowerBound;
  const auto cell = [](float part, float whole) {
    return static_cast<std::uint32_t>(whole > 0.0F ? std::min(part / whole, 1.0F) * kCells : 0.0F);
  };
  return spread(cell(offset.x, size.x)) | spread(cell(offset.y, size.y)) << 1U;
}

Part merged(const Part* parts, std::size_t count, std::uint32_t child) {
  Part all{parts[0].box, child, parts[0].category_bits};
  for (std::size_t i = 1; i < count; ++i) {
    all.box.Combine(parts[i].box);
    all.category_bits = static_cast<std::uint16_t>(all.category_bits | parts[i].category_bits);
  }
  return all;
}

EdgeTree::Node node_of(const Part* parts, std::size_t count) {
  EdgeTree::Node node;
  node.count = static_cast<std::uint32_t>(count);
  for (std::size_t i = 0; i < kFanOut; ++i) {
    const Part& part = parts[std::min(i, count - 1)];
    // Enlarged like the boxes of single solids; see DepthScan.
    node.min_x[i] = part.box.lowerBound.x - b2_aabbExtension;
    node.min_y[i] = part.box.lowerBound.y - b2_aabbExtension;
    node.max_x[i] = part.box.upperBound.x + b2_aabbExtension;
    node.max_y[i] = part.box.upperBound.y + b2_aabbExtension;
    node.child[i] = part.child;
    node.category_bits[i] = i < count ? part.category_bits : std::uint16_t{0};
  }
  return node;
}

}  // namespace

SolidTree::SolidTree(const std::vector<b2Fixture*>& solids) {
  b2AABB bounds{b2Vec2_zero, b2Vec2_zero};
  for (b2Fixture* solid : solids) {
    const b2AABB& box = solid->GetAABB(0);
    if (!is_finite(box)) {
      loose_.push_back(solid);
      continue;
    }
    if (solids_.empty()) bounds = box;
    bounds.Combine(box);
    solids_.push_back(solid);
  }
  if (solids_.empty()) return;
  // The index makes the order, and hence everything computed from it, unique.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  order.reserve(solids_.size());
  for (std::uint32_t i = 0; i < solids_.size(); ++i) {
    order.emplace_back(place_of(solids_[i]->GetAABB(0), bounds), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<b2Fixture*> sorted(order.size());
  std::vector<Part> level(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    sorted[i] = solids_[order[i].second];
    level[i] = {sorted[i]->GetAABB(0), 0, sorted[i]->GetFilterData().categoryBits};
  }
  solids_ = std::move(sorted);

  // Leaves, then levels of nodes up to the root, which becomes the first node.
  std::vector<EdgeTree::Node> reversed;
  bool is_leaf = true;
  do {
    std::vector<Part> above;
    for (std::size_t first = 0; first < level.size(); first += kFanOut) {
      const std::size_t count = std::min(kFanOut, level.size() - first);
      if (is_leaf) {
        const auto leaf = static_cast<std::uint32_t>(first / kFanOut);
        above.push_back(merged(&level[first], count, EdgeTree::kLeafBit | leaf));
      } else {
        above.push_back(merged(&level[first], count, static_cast<std::uint32_t>(reversed.size())));
        reversed.push_back(node_of(&level[first], count));
      }
    }
    level = std::move(above);
    is_leaf = false;
  } while (level.size() > kFanOut);
  reversed.push_back(node_of(level.data(), level.size()));
  nodes_.assign(reversed.rbegin(), reversed.rend());
  const auto last = static_cast<std::uint32_t>(nodes_.size() - 1);
  for (EdgeTree::Node& node : nodes_) {
    for (std::uint32_t& child : node.child) {
      if ((child & EdgeTree::kLeafBit) == 0) child = last - child;
    }
  }
}

}  // namespace flatland
