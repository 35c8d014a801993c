// From a bitmap to the exact boundary between its on and off pixels.
//
// Everything outside the bitmap is on. Pixel corners have integer coordinates: x counts columns
// from the left edge, y counts rows upwards from the bottom edge (image rows run downwards).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace flatland {

// A view of pixels in row-major order, the top row first; non-zero is on.
struct Bitmap {
  const std::uint8_t* pixels;
  std::size_t rows;
  std::size_t cols;
};

// A straight piece of boundary [m].
struct BoundaryEdge {
  float x1, y1, x2, y2;
};

// A pixel corner.
struct PixelCorner {
  std::int32_t x, y;
};

// Closed loops, one behind the other: loop i has the points starts[i] .. starts[i + 1] - 1, and
// the last entry of starts is the number of points.
struct BoundaryLoops {
  std::vector<PixelCorner> points;
  std::vector<std::int64_t> starts;
};

// Largest number of rows or columns, so that corners fit into 32 bits.
inline constexpr std::size_t kMaxBitmapSide = 0x7FFFFFF0;

// Every maximal horizontal run of flipped pixels between two rows, and every maximal vertical run
// between two columns, with coordinates corner * resolution computed in double precision. A run
// goes on through a corner where only diagonal neighbours are equal. The order depends on the
// bitmap alone.
std::vector<BoundaryEdge> boundary_edges(const Bitmap& bitmap, double resolution);

// The same boundary as closed loops through the corners where it turns, on pixels to the left.
// Where four pieces of boundary meet in one corner, each of the two on pixels keeps its own two
// sides, so on pixels are connected by sides only. Loops start at their topmost, then leftmost
// corner and are ordered by that corner from the top.
BoundaryLoops boundary_loops(const Bitmap& bitmap);

}  // namespace flatland
