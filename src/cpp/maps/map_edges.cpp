#include "maps/map_edges.h"

#include <cstring>
#include <utility>

namespace flatland {
namespace {

// Number of corners that are processed together, as the bytes of one machine word.
constexpr std::size_t kWordSize = sizeof(std::uint64_t);

std::uint64_t load_word(const std::uint8_t* bytes) {
  std::uint64_t word;
  std::memcpy(&word, bytes, kWordSize);
  return word;
}

// One row of the bitmap as zeros and ones. The pixel to the left of corner x has the index x, the
// pixel to the right has the index x + 1. Pixels beyond both ends of the row are on.
class PaddedRow {
 public:
  explicit PaddedRow(std::size_t cols) : bytes_(cols + 2 + kWordSize, 1), cols_(cols) {}

  void copy_from(const std::uint8_t* pixels) {
    for (std::size_t i = 0; i < cols_; ++i) bytes_[i + 1] = pixels[i] != 0;
  }
  void turn_on() {
    for (std::size_t i = 0; i < cols_; ++i) bytes_[i + 1] = 1;
  }
  const std::uint8_t* data() const { return bytes_.data(); }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t cols_;
};

// A corner at which the boundary turns. Three of the four adjacent pixels are equal, or, at a
// crossing, only diagonally adjacent pixels.
struct Turn {
  std::int32_t x;
  std::int32_t line;  // counted downwards from the top edge
  bool crossing;
  bool upper_left, lower_right;  // whether these pixels are on
};

// Calls visit(Turn) for each turn, line by line from the top, from left to right.
template <typename Visit>
void for_each_turn(const Bitmap& bitmap, Visit&& visit) {
  const std::size_t cols = bitmap.cols;
  PaddedRow upper(cols);
  PaddedRow lower(cols);
  for (std::size_t line = 0; line <= bitmap.rows; ++line) {
    if (line < bitmap.rows) {
      lower.copy_from(bitmap.pixels + line * cols);
    } else {
      lower.turn_on();
    }
    const std::uint8_t* a = upper.data();
    const std::uint8_t* b = lower.data();
    for (std::size_t first = 0; first <= cols; first += kWordSize) {
      const std::uint64_t flip_above = load_word(a + first) ^ load_word(a + first + 1);
      const std::uint64_t flip_below = load_word(b + first) ^ load_word(b + first + 1);
      const std::uint64_t flip_left = load_word(a + first) ^ load_word(b + first);
      // Almost all words of a typical map have no turn.
      if (((flip_above ^ flip_below) | (flip_above & flip_below & flip_left)) == 0) continue;
      for (std::size_t x = first; x < first + kWordSize; ++x) {
        const bool odd = (a[x] ^ a[x + 1] ^ b[x] ^ b[x + 1]) != 0;
        const bool crossing = a[x] == b[x + 1] && a[x + 1] == b[x] && a[x] != b[x];
        if (odd || crossing) {
          visit(Turn{static_cast<std::int32_t>(x), static_cast<std::int32_t>(line), crossing,
                     a[x] != 0, b[x + 1] != 0});
        }
      }
    }
    std::swap(upper, lower);
  }
}

}  // namespace

std::vector<BoundaryEdge> boundary_edges(const Bitmap& bitmap, double resolution) {
  const auto metres = [resolution](std::int32_t corner) {
    return static_cast<float>(corner * resolution);
  };
  const auto rows = static_cast<std::int32_t>(bitmap.rows);
  constexpr std::int32_t kNone = -1;

  // At a turn without crossing, exactly one horizontal and one vertical run starts or ends.
  std::vector<BoundaryEdge> edges;
  std::vector<std::int32_t> column_start(bitmap.cols + 1, kNone);
  std::int32_t row_start = kNone;
  for_each_turn(bitmap, [&](const Turn& turn) {
    if (turn.crossing) return;
    if (row_start == kNone) {
      row_start = turn.x;
    } else {
      const float y = metres(rows - turn.line);
      edges.push_back({metres(row_start), y, metres(turn.x), y});
      row_start = kNone;
    }
    std::int32_t& start = column_start[static_cast<std::size_t>(turn.x)];
    if (start == kNone) {
      start = turn.line;
    } else {
      const float x = metres(turn.x);
      edges.push_back({x, metres(rows - start), x, metres(rows - turn.line)});
      start = kNone;
    }
  });
  return edges;
}

namespace {

// The index of a corner of a loop. A crossing consists of two nodes.
using Node = std::int64_t;
constexpr Node kNoNode = -1;

// The corners of all loops, each with the other ends of its horizontal and its vertical side.
struct LoopGraph {
  std::vector<PixelCorner> corners;
  std::vector<Node> along_row;
  std::vector<Node> along_column;
  std::vector<bool> lower_right_on;

  // Adds a corner, which ends the open side in each direction, or starts one if no side is open. An
  // open side is represented by the node at which it starts.
  void add(PixelCorner corner, bool lower_right, Node& open_in_row, Node& open_in_column) {
    const auto node = static_cast<Node>(corners.size());
    corners.push_back(corner);
    lower_right_on.push_back(lower_right);
    along_row.push_back(join(along_row, open_in_row, node));
    along_column.push_back(join(along_column, open_in_column, node));
  }

 private:
  static Node join(std::vector<Node>& other_end, Node& open, Node node) {
    const Node start = open;
    if (start == kNoNode) {
      open = node;
    } else {
      other_end[static_cast<std::size_t>(start)] = node;
      open = kNoNode;
    }
    return start;
  }
};

LoopGraph connect_corners(const Bitmap& bitmap) {
  const auto rows = static_cast<std::int32_t>(bitmap.rows);
  LoopGraph graph;
  std::vector<Node> open_columns(bitmap.cols + 1, kNoNode);
  Node open_row = kNoNode;
  for_each_turn(bitmap, [&](const Turn& turn) {
    const PixelCorner corner{turn.x, rows - turn.line};
    Node& open_column = open_columns[static_cast<std::size_t>(turn.x)];
    if (!turn.crossing) {
      graph.add(corner, turn.lower_right, open_row, open_column);
    } else if (turn.upper_left) {
      // The sides of the upper left pixel end here; those of the lower right pixel start here.
      graph.add(corner, turn.lower_right, open_row, open_column);
      graph.add(corner, turn.lower_right, open_row, open_column);
    } else {
      // The upper right pixel has the sides to the right and from above, the lower left pixel those
      // from the left and downwards.
      Node new_row = kNoNode;
      Node new_column = kNoNode;
      graph.add(corner, turn.lower_right, new_row, open_column);
      graph.add(corner, turn.lower_right, open_row, new_column);
      open_row = new_row;
      open_column = new_column;
    }
  });
  return graph;
}

}  // namespace

BoundaryLoops boundary_loops(const Bitmap& bitmap) {
  const LoopGraph graph = connect_corners(bitmap);
  const std::size_t count = graph.corners.size();
  BoundaryLoops loops;
  loops.points.reserve(count);
  std::vector<bool> visited(count, false);
  for (std::size_t first = 0; first < count; ++first) {
    if (visited[first]) continue;
    loops.starts.push_back(static_cast<std::int64_t>(loops.points.size()));
    // The sides of the first corner of a loop lead to the right and downwards. The pixel between
    // them determines the orientation with on pixels to the left.
    bool horizontal = !graph.lower_right_on[first];
    std::size_t node = first;
    do {
      visited[node] = true;
      loops.points.push_back(graph.corners[node]);
      node =
          static_cast<std::size_t>(horizontal ? graph.along_row[node] : graph.along_column[node]);
      horizontal = !horizontal;
    } while (node != first);
  }
  loops.starts.push_back(static_cast<std::int64_t>(loops.points.size()));
  return loops;
}

}  // namespace flatland
