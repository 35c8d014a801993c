// Exact boundaries between the on and off pixels of a bitmap.
//
// All pixels outside the bitmap are on. The corners of pixels have integer coordinates: x counts
// columns from the left edge, y counts rows upwards from the bottom edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace flatland {

// A view of pixels in row-major order with the top row first; a pixel is on if it is non-zero.
struct Bitmap {
  const std::uint8_t* pixels;
  std::size_t rows;
  std::size_t cols;
};

// A straight segment of a boundary [m].
struct BoundaryEdge {
  float x1, y1, x2, y2;
};

// The corner of a pixel.
struct PixelCorner {
  std::int32_t x, y;
};

// Concatenated closed loops. The points of loop i are starts[i] to starts[i + 1] - 1; the last
// entry of starts is the number of points.
struct BoundaryLoops {
  std::vector<PixelCorner> points;
  std::vector<std::int64_t> starts;
};

// Maximum number of rows and columns, so that coordinates of corners are in the 32-bit range.
inline constexpr std::size_t kMaxBitmapSide = 0x7FFFFFF0;

// Returns each maximal horizontal run between pixels that differ in two adjacent rows, and each
// maximal vertical run between two columns. Coordinates are corner * resolution in double
// precision. A run continues through a corner at which only diagonally adjacent pixels are equal.
// The order depends only on the bitmap.
std::vector<BoundaryEdge> boundary_edges(const Bitmap& bitmap, double resolution);

// Returns the same boundary as closed loops of the corners at which it turns, with on pixels to the
// left. Two on pixels are connected only through a common side, so at a corner where four sides of
// the boundary meet, the two sides of each on pixel belong together. Loops start at their topmost,
// then leftmost corner and are sorted by this corner from the top.
BoundaryLoops boundary_loops(const Bitmap& bitmap);

}  // namespace flatland
