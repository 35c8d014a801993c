// Shapes, regions and distances in bitmaps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "maps/map_edges.h"

namespace flatland {

// A horizontal run of pixels of a shape: its row and its first and last column, relative to the
// reference pixel of the shape.
struct ShapeRun {
  std::int32_t row, first, last;
};

// Returns 1 for each pixel around which the shape covers a pixel that is on, otherwise 0. Pixels
// outside the bitmap are on if `outside` is set.
std::vector<std::uint8_t> dilated(const Bitmap& bitmap, const std::vector<ShapeRun>& shape,
                                  bool outside);

// Returns for each pixel the number of its connected region of on pixels, from 1, and 0 for off
// pixels. Regions are numbered in the order of their first pixels, row by row. If diagonally
// adjacent pixels are connected, blocks of 2 x 2 pixels take the place of pixels in this order.
std::vector<std::int32_t> connected_regions(const Bitmap& bitmap, bool diagonally);

// A pixel of a bitmap.
struct Pixel {
  std::size_t row, col;
};

// Returns whether a path of on pixels, which may be diagonally adjacent, connects two on pixels
// within the rows and columns from `low` to `high`, both of which are included.
bool are_connected(const Bitmap& bitmap, Pixel a, Pixel b, Pixel low, Pixel high);

// Returns the distance from the centre of each pixel to that of the nearest off pixel [pixels];
// infinite if all pixels are on.
std::vector<float> distances_to_off(const Bitmap& bitmap);

// Simplifies a closed loop by the method of Ramer, Douglas and Peucker: its points are a subset of
// those of the loop, and the loop is within the tolerance of the lines between them. Afterwards,
// single points are removed that are within 0.71 of the tolerance of the line between their
// neighbours.
std::vector<PixelCorner> simplified_loop(const std::vector<PixelCorner>& loop, double tolerance);

}  // namespace flatland
