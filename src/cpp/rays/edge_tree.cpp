#include "rays/edge_tree.h"

#include <box2d/b2_math.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace flatland {
namespace {

struct Box {
  float min_x = std::numeric_limits<float>::infinity();
  float min_y = std::numeric_limits<float>::infinity();
  float max_x = -std::numeric_limits<float>::infinity();
  float max_y = -std::numeric_limits<float>::infinity();

  void add(float x, float y) {
    min_x = std::min(min_x, x);
    min_y = std::min(min_y, y);
    max_x = std::max(max_x, x);
    max_y = std::max(max_y, y);
  }
  void add(const Box& other) {
    min_x = std::min(min_x, other.min_x);
    min_y = std::min(min_y, other.min_y);
    max_x = std::max(max_x, other.max_x);
    max_y = std::max(max_y, other.max_y);
  }
  float half_perimeter() const { return max_x < min_x ? 0.0F : max_x - min_x + max_y - min_y; }
};

Box box_of(const TreeEdge& edge) {
  Box box;
  box.add(edge.x1, edge.y1);
  box.add(edge.x2, edge.y2);
  return box;
}

std::uint16_t all_bits(const TreeEdge& edge) {
  return static_cast<std::uint16_t>(edge.category_bits | edge.coincident_bits);
}

float center_x(const TreeEdge& edge) { return 0.5F * (edge.x1 + edge.x2); }
float center_y(const TreeEdge& edge) { return 0.5F * (edge.y1 + edge.y2); }

}  // namespace

// Builds the tree top-down. Splits minimize the sum over both sides of the perimeter of the
// bounding box times the number of leaves.
class EdgeTreeBuilder {
 public:
  EdgeTreeBuilder(EdgeTree& tree, std::vector<TreeEdge>& edges) : tree_(tree), edges_(edges) {}

  void build() { make_node({0, edges_.size()}, 0); }

 private:
  using Node = EdgeTree::Node;
  static constexpr std::size_t kFanOut = EdgeTree::kFanOut;
  static constexpr std::size_t kBins = 32;

  struct Range {
    std::size_t begin, end;
    std::size_t size() const { return end - begin; }
  };

  std::uint32_t make_node(Range range, std::size_t depth) {
    const auto index = static_cast<std::uint32_t>(tree_.nodes_.size());
    tree_.nodes_.emplace_back();
    // Split the largest part until there are 8 parts, or until each part fits into a leaf.
    std::vector<Range> parts{range};
    while (parts.size() < kFanOut) {
      const auto largest =
          std::max_element(parts.begin(), parts.end(),
                           [](const Range& a, const Range& b) { return a.size() < b.size(); });
      if (largest->size() <= kFanOut) break;
      const bool is_deep = depth > EdgeTree::kMaxDepth / 2;
      const std::size_t middle = is_deep ? halve(*largest) : split(*largest);
      const Range rest{middle, largest->end};
      largest->end = middle;
      parts.push_back(rest);
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::uint32_t child =
          parts[i].size() <= kFanOut ? make_leaf(parts[i]) : make_node(parts[i], depth + 1);
      set_child(tree_.nodes_[index], i, parts[i], child);
    }
    pad(tree_.nodes_[index], parts.size());
    return index;
  }

  void set_child(Node& node, std::size_t i, Range range, std::uint32_t child) const {
    Box box;
    std::uint16_t bits = 0;
    for (std::size_t e = range.begin; e < range.end; ++e) {
      box.add(box_of(edges_[e]));
      bits = static_cast<std::uint16_t>(bits | all_bits(edges_[e]));
    }
    node.min_x[i] = box.min_x;
    node.min_y[i] = box.min_y;
    node.max_x[i] = box.max_x;
    node.max_y[i] = box.max_y;
    node.child[i] = child;
    node.category_bits[i] = bits;
  }

  // Unused entries repeat the last child, so that all numbers are initialized and finite.
  static void pad(Node& node, std::size_t count) {
    node.count = static_cast<std::uint32_t>(count);
    for (std::size_t i = count; i < kFanOut; ++i) {
      node.min_x[i] = node.min_x[count - 1];
      node.min_y[i] = node.min_y[count - 1];
      node.max_x[i] = node.max_x[count - 1];
      node.max_y[i] = node.max_y[count - 1];
      node.child[i] = node.child[count - 1];
      node.category_bits[i] = 0;
    }
  }

  std::uint32_t make_leaf(Range range) {
    EdgeTree::Leaf leaf;
    EdgeTree::LeafFixtures fixtures;
    leaf.count = static_cast<std::uint16_t>(range.size());
    leaf.common_bits = 0xFFFF;
    for (std::size_t i = 0; i < kFanOut; ++i) {
      const TreeEdge& edge = edges_[std::min(range.begin + i, range.end - 1)];
      b2Vec2 normal(edge.y2 - edge.y1, -(edge.x2 - edge.x1));
      normal.Normalize();
      leaf.x1[i] = edge.x1;
      leaf.y1[i] = edge.y1;
      leaf.x2[i] = edge.x2;
      leaf.y2[i] = edge.y2;
      leaf.normal_x[i] = normal.x;
      leaf.normal_y[i] = normal.y;
      leaf.category_bits[i] = edge.category_bits;
      leaf.coincident_bits[i] = edge.coincident_bits;
      leaf.common_bits = static_cast<std::uint16_t>(leaf.common_bits & edge.category_bits);
      fixtures.fixture[i] = edge.fixture;
      fixtures.coincident[i] = edge.coincident_fixture;
      fixtures.material[i] = edge.material;
      fixtures.has_materials = fixtures.has_materials || edge.material != 0;
      fixtures.has_coincident = fixtures.has_coincident || edge.coincident_bits != 0;
    }
    tree_.leaves_.push_back(leaf);
    tree_.leaf_fixtures_.push_back(fixtures);
    return EdgeTree::kLeafBit | static_cast<std::uint32_t>(tree_.leaves_.size() - 1);
  }

  // Partitions the edges of a range; returns the index of the first edge on the second side.
  std::size_t split(Range range) {
    Box centers;
    for (std::size_t e = range.begin; e < range.end; ++e) {
      centers.add(center_x(edges_[e]), center_y(edges_[e]));
    }
    const Split split_x = best_split(range, &center_x, centers.min_x, centers.max_x);
    const Split split_y = best_split(range, &center_y, centers.min_y, centers.max_y);
    const Split& best = split_x.cost <= split_y.cost ? split_x : split_y;
    if (!std::isfinite(best.cost)) return halve(range);
    const auto is_first = [&](const TreeEdge& edge) { return best.bin_of(edge) < best.bin; };
    const auto at = [&](std::size_t i) { return edges_.begin() + static_cast<std::ptrdiff_t>(i); };
    return static_cast<std::size_t>(std::partition(at(range.begin), at(range.end), is_first) -
                                    edges_.begin());
  }

  static std::size_t halve(Range range) { return range.begin + range.size() / 2; }

  struct Split {
    float (*center)(const TreeEdge&);
    float origin, bins_per_metre;
    std::size_t bin = 0;  // first bin of the second side
    float cost = std::numeric_limits<float>::infinity();

    std::size_t bin_of(const TreeEdge& edge) const {
      const float bin_number = (center(edge) - origin) * bins_per_metre;
      return std::min(static_cast<std::size_t>(std::max(bin_number, 0.0F)), kBins - 1);
    }
  };

  static float leaves_in(std::size_t edges) {
    return static_cast<float>((edges + kFanOut - 1) / kFanOut);
  }

  Split best_split(Range range, float (*center)(const TreeEdge&), float lowest,
                   float highest) const {
    Split best{center, lowest, static_cast<float>(kBins) / (highest - lowest)};
    if (!(highest > lowest) || !std::isfinite(best.bins_per_metre)) return best;
    std::array<Box, kBins> boxes;
    std::array<std::size_t, kBins> counts{};
    for (std::size_t e = range.begin; e < range.end; ++e) {
      const std::size_t bin = best.bin_of(edges_[e]);
      boxes[bin].add(box_of(edges_[e]));
      ++counts[bin];
    }
    std::array<float, kBins> cost_after{};  // cost of a bin together with all later bins
    Box box;
    std::size_t count = 0;
    for (std::size_t bin = kBins; bin-- > 1;) {
      box.add(boxes[bin]);
      count += counts[bin];
      cost_after[bin] = box.half_perimeter() * leaves_in(count);
    }
    box = Box();
    count = 0;
    for (std::size_t bin = 1; bin < kBins; ++bin) {
      box.add(boxes[bin - 1]);
      count += counts[bin - 1];
      if (count == 0 || count == range.size()) continue;
      const float cost = box.half_perimeter() * leaves_in(count) + cost_after[bin];
      if (cost < best.cost) {
        best.cost = cost;
        best.bin = bin;
      }
    }
    return best;
  }

  EdgeTree& tree_;
  std::vector<TreeEdge>& edges_;
};

void merge_coincident(std::vector<TreeEdge>& edges) {
  const auto place = [](const TreeEdge& e) { return std::tie(e.x1, e.y1, e.x2, e.y2); };
  const auto is_before = [&](const TreeEdge& a, const TreeEdge& b) {
    return std::tuple_cat(place(a), std::tie(a.material, a.category_bits, a.fixture)) <
           std::tuple_cat(place(b), std::tie(b.material, b.category_bits, b.fixture));
  };
  std::sort(edges.begin(), edges.end(), is_before);
  std::size_t kept = 0;
  for (const TreeEdge& edge : edges) {
    TreeEdge* last = kept == 0 ? nullptr : &edges[kept - 1];
    if (last != nullptr && place(*last) == place(edge) && last->material == edge.material) {
      if (edge.category_bits == last->category_bits ||
          edge.category_bits == last->coincident_bits) {
        continue;
      }
      if (last->coincident_bits == 0) {
        last->coincident_bits = edge.category_bits;
        last->coincident_fixture = edge.fixture;
        continue;
      }
    }
    edges[kept++] = edge;
  }
  edges.resize(kept);
}

EdgeTree::EdgeTree(std::vector<TreeEdge> edges) {
  for (const TreeEdge& edge : edges) {
    category_bits_ = static_cast<std::uint16_t>(category_bits_ | all_bits(edge));
  }
  if (!edges.empty()) EdgeTreeBuilder(*this, edges).build();
}

}  // namespace flatland
