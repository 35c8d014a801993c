#include "maps/map_edges.h"

#include <cstring>
#include <utility>

namespace flatland {
namespace {

// Corners that are looked at together, as the bytes of one machine word.
constexpr std::size_t kWordSize = sizeof(std::uint64_t);

std::uint64_t load_word(const std::uint8_t* bytes) {
  std::uint64_t word;
  std::memcpy(&word, bytes, kWordSize);
  return word;
}

// One row of the bitmap as zeros and ones. The pixel left of corner x is at [x], the one right of
// it at [x + 1]; what lies beyond either end of the row is on.
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

// A corner that is more than a point on a straight piece of boundary. Three of the four pixels
// around it are equal, or (`crossing`) only the diagonal ones are.
struct Turn {
  std::int32_t x;
  std::int32_t line;  // counted downwards from the top edge
  bool crossing;
  bool upper_left, lower_right;  // state of two of the pixels
};

// Calls visit(Turn) for every turn, line by line from the top, each line from the left.
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
      // Nearly all words of a real map have no turn.
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

  // At an odd corner exactly one horizontal and one vertical run starts or ends.
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

// Index of a corner of a loop; a corner where two loops meet has two.
using Node = std::int64_t;
constexpr Node kNoNode = -1;

// Corners of the loops, each with the other end of its horizontal and its vertical side.
struct LoopGraph {
  std::vector<PixelCorner> corners;
  std::vector<Node> along_row;
  std::vector<Node> along_column;
  std::vector<bool> lower_right_on;

  // Adds a corner. An open side (the node where it starts) ends there; where there is none the
  // corner opens one.
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
      // The upper left pixel's sides end here, then the lower right one's start.
      graph.add(corner, turn.lower_right, open_row, open_column);
      graph.add(corner, turn.lower_right, open_row, open_column);
    } else {
      // The upper right pixel has the side to the right and the one from above, the lower left
      // pixel those from the left and to below.
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
    // The first corner of a loop is an upper left one: its sides lead right and down. The pixel
    // between them decides which way round keeps on pixels to the left.
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
