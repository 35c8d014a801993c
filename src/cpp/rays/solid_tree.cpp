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
  // The sum is not finite if one of the numbers is not finite. The sum of large numbers can
  // overflow, too; the box then counts as not finite.
  return std::isfinite(box.lowerBound.x + box.lowerBound.y + box.upperBound.x + box.upperBound.y);
}

// Inserts a zero between the lower 16 bits of a number.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 8U) & 0x00FF00FFU;
  x = (x | x << 4U) & 0x0F0F0F0FU;
  x = (x | x << 2U) & 0x33333333U;
  return (x | x << 1U) & 0x55555555U;
}

// Returns the position of a box along a curve that fills the bounds, a Morton code. Neighbours on
// the curve are neighbours in space.
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

// Sets a box of a node or group.
template <typename Boxes>
void enlarge(const b2AABB& box, std::size_t i, Boxes& out) {
  out.min_x[i] = box.lowerBound.x - b2_aabbExtension;
  out.min_y[i] = box.lowerBound.y - b2_aabbExtension;
  out.max_x[i] = box.upperBound.x + b2_aabbExtension;
  out.max_y[i] = box.upperBound.y + b2_aabbExtension;
}

std::vector<SolidGroup> groups_of(const std::vector<b2Fixture*>& solids) {
  std::vector<SolidGroup> groups;
  groups.reserve((solids.size() + kFanOut - 1) / kFanOut);
  for (std::size_t first = 0; first < solids.size(); first += kFanOut) {
    groups.emplace_back(&solids[first], std::min(kFanOut, solids.size() - first));
  }
  return groups;
}

EdgeTree::Node node_of(const Part* parts, std::size_t count) {
  EdgeTree::Node node;
  node.count = static_cast<std::uint32_t>(count);
  for (std::size_t i = 0; i < kFanOut; ++i) {
    const Part& part = parts[std::min(i, count - 1)];
    enlarge(part.box, i, node);
    node.child[i] = part.child;
    node.category_bits[i] = i < count ? part.category_bits : std::uint16_t{0};
  }
  return node;
}

}  // namespace

SolidGroup::SolidGroup(b2Fixture* const* fixtures, std::size_t size)
    : count(static_cast<std::uint32_t>(size)) {
  for (std::size_t i = 0; i < kFanOut; ++i) {
    solids[i] = fixtures[std::min(i, size - 1)];
    enlarge(solids[i]->GetAABB(0), i, *this);
  }
}

SolidTree::SolidTree(const std::vector<b2Fixture*>& solids, bool has_nodes) {
  if (!has_nodes) {
    loose_ = groups_of(solids);
    return;
  }
  std::vector<b2Fixture*> finite, loose;
  b2AABB bounds{b2Vec2_zero, b2Vec2_zero};
  for (b2Fixture* solid : solids) {
    const b2AABB& box = solid->GetAABB(0);
    if (!is_finite(box)) {
      loose.push_back(solid);
      continue;
    }
    if (finite.empty()) bounds = box;
    bounds.Combine(box);
    finite.push_back(solid);
  }
  loose_ = groups_of(loose);
  if (!finite.empty()) build(std::move(finite), bounds);
}

void SolidTree::build(std::vector<b2Fixture*> solids, const b2AABB& bounds) {
  // The index makes the order unique, and thus all results that depend on the order.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  order.reserve(solids.size());
  for (std::uint32_t i = 0; i < solids.size(); ++i) {
    order.emplace_back(place_of(solids[i]->GetAABB(0), bounds), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<b2Fixture*> sorted(order.size());
  std::vector<Part> level(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    sorted[i] = solids[order[i].second];
    level[i] = {sorted[i]->GetAABB(0), 0, sorted[i]->GetFilterData().categoryBits};
  }
  groups_ = groups_of(sorted);

  // The leaves are created first, then the levels of nodes up to the root. The root becomes the
  // first node.
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
