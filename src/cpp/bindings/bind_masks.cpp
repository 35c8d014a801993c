#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/masks.h"
#include "maps/masks.h"

namespace py = pybind11;

namespace flatland {
namespace {

// The largest row or column of a run of a shape, so that sums with columns are in range.
constexpr std::int32_t kMaxReach = 1 << 24;

// Computes an array of the shape of a mask.
template <typename Value, typename Compute>
py::array_t<Value> of_each_pixel(const py::array& mask, Compute&& compute) {
  const py::array pixels = checked_mask(mask);
  const Bitmap bitmap = view_of(pixels);
  std::vector<Value> values;
  {
    // Safe without the GIL: `pixels` keeps the memory alive, and no Python object is accessed.
    py::gil_scoped_release unlocked;
    values = compute(bitmap);
  }
  py::array_t<Value> result({pixels.shape(0), pixels.shape(1)});
  std::copy_n(values.data(), values.size(), result.mutable_data());
  return result;
}

std::vector<ShapeRun> checked_shape(const Array<std::int32_t>& shape) {
  check_shape(shape, 3, "shape");
  std::vector<ShapeRun> runs;
  for (py::ssize_t i = 0; i < shape.shape(0); ++i) {
    const ShapeRun run{shape.at(i, 0), shape.at(i, 1), shape.at(i, 2)};
    const std::int32_t reach[] = {run.row, run.first, run.last};
    const bool is_near = std::all_of(std::begin(reach), std::end(reach), [](std::int32_t value) {
      return -kMaxReach <= value && value <= kMaxReach;
    });
    if (!is_near || run.first > run.last) {
      throw py::value_error(
          "shape must have rows (row, first, last) with first <= last, within +-" +
          std::to_string(kMaxReach) + ", got row " + std::to_string(i) + ": (" +
          std::to_string(run.row) + ", " + std::to_string(run.first) + ", " +
          std::to_string(run.last) + ")");
    }
    runs.push_back(run);
  }
  return runs;
}

py::array_t<std::uint8_t> py_dilated(const py::array& mask, const Array<std::int32_t>& shape,
                                     bool outside) {
  const std::vector<ShapeRun> runs = checked_shape(shape);
  return of_each_pixel<std::uint8_t>(
      mask, [&](const Bitmap& bitmap) { return dilated(bitmap, runs, outside); });
}

py::array_t<std::int32_t> py_connected_regions(const py::array& mask, bool diagonally) {
  return of_each_pixel<std::int32_t>(
      mask, [&](const Bitmap& bitmap) { return connected_regions(bitmap, diagonally); });
}

using IndexPair = std::pair<py::ssize_t, py::ssize_t>;  // row, column

std::string text_of(Pixel pixel) {
  return "(" + std::to_string(pixel.row) + ", " + std::to_string(pixel.col) + ")";
}

// Returns a pixel; throws a ValueError unless it is from `low` to `high`.
Pixel checked_pixel(const char* name, const IndexPair& pixel, Pixel low, Pixel high) {
  const auto [row, col] = pixel;
  const Pixel found{static_cast<std::size_t>(row), static_cast<std::size_t>(col)};
  const bool is_inside = row >= 0 && found.row >= low.row && found.row <= high.row && col >= 0 &&
                         found.col >= low.col && found.col <= high.col;
  if (is_inside) return found;
  throw py::value_error(std::string(name) + " must be from " + text_of(low) + " to " +
                        text_of(high) + ", got (" + std::to_string(row) + ", " +
                        std::to_string(col) + ")");
}

bool py_are_connected(const py::array& mask, const IndexPair& start, const IndexPair& goal,
                      const IndexPair& first, const IndexPair& last) {
  const py::array pixels = checked_mask(mask);
  const Bitmap bitmap = view_of(pixels);
  if (bitmap.rows == 0 || bitmap.cols == 0) throw py::value_error("mask must not be empty");
  const Pixel low = checked_pixel("first", first, {0, 0}, {bitmap.rows - 1, bitmap.cols - 1});
  const Pixel high = checked_pixel("last", last, low, {bitmap.rows - 1, bitmap.cols - 1});
  return are_connected(bitmap, checked_pixel("start", start, low, high),
                       checked_pixel("goal", goal, low, high), low, high);
}

py::array_t<float> py_distances_to_off(const py::array& mask) {
  return of_each_pixel<float>(mask, distances_to_off);
}

py::array_t<std::int32_t> py_simplified_loop(const Array<std::int32_t>& loop, double tolerance) {
  check_shape(loop, 2, "loop");
  if (!(tolerance >= 0.0)) {
    throw py::value_error("tolerance must not be negative, got " +
                          std::string(py::repr(py::float_(tolerance))));
  }
  std::vector<PixelCorner> points(static_cast<std::size_t>(loop.shape(0)));
  static_assert(sizeof(PixelCorner) == 2 * sizeof(std::int32_t), "points must be packed");
  if (!points.empty()) std::memcpy(points.data(), loop.data(), points.size() * sizeof(points[0]));
  {
    // Safe without the GIL: the points are a copy.
    py::gil_scoped_release unlocked;
    points = simplified_loop(points, tolerance);
  }
  py::array_t<std::int32_t> result({points.size(), std::size_t{2}});
  if (!points.empty()) {
    std::memcpy(result.mutable_data(), points.data(), points.size() * sizeof(points[0]));
  }
  return result;
}

}  // namespace

void bind_masks(py::module_& module) {
  module.def("dilated", &py_dilated, py::arg("mask"), py::arg("shape"), py::kw_only(),
             py::arg("outside") = false, R"(
Returns where a shape covers a pixel that is on.

Args:
    mask: Pixels, shape (rows, columns), bool or uint8.
    shape: Horizontal runs of pixels: row, first and last column, each relative to the reference
        pixel of the shape; shape (n, 3).
    outside: Whether the pixels outside the mask are on.

Returns:
    1 for each pixel at which the shape with this reference pixel covers a pixel that is on,
    otherwise 0; shape (rows, columns).

Raises:
    ValueError: The mask or the shape has a wrong shape or type, or a run is invalid.
)");
  module.def("connected_regions", &py_connected_regions, py::arg("mask"), py::kw_only(),
             py::arg("diagonally"), R"(
Returns the connected regions of the on pixels of a mask.

Args:
    mask: Pixels, shape (rows, columns), bool or uint8.
    diagonally: Whether pixels that have only a corner in common are connected.

Returns:
    For each pixel the number of its region, from 1, and 0 for off pixels; shape (rows, columns).
    Regions are numbered in the order of their first pixels, row by row; if pixels are connected
    diagonally, in the order of their first blocks of 2 x 2 pixels.

Raises:
    ValueError: The mask has a wrong shape or type.
)");
  module.def("are_connected", &py_are_connected, py::arg("mask"), py::arg("start"), py::arg("goal"),
             py::arg("first"), py::arg("last"), R"(
Returns whether a path of on pixels connects two pixels within a rectangle of a mask.

Args:
    mask: Pixels, shape (rows, columns), bool or uint8.
    start: Row and column of a pixel; it belongs to the path.
    goal: Row and column of another one.
    first: First row and column of the rectangle.
    last: Its last row and column.

Returns:
    Whether there is a path from pixel to pixel, which may be diagonally adjacent.

Raises:
    ValueError: The mask has a wrong shape or type, or a pixel is outside of it or the rectangle.
)");
  module.def("distances_to_off", &py_distances_to_off, py::arg("mask"), R"(
Returns the distances between the centers of pixels and of the nearest off pixels.

Args:
    mask: Pixels, shape (rows, columns), bool or uint8.

Returns:
    Distance of each pixel [pixels], 0 for off pixels, infinite if all pixels are on; shape (rows,
    columns).

Raises:
    ValueError: The mask has a wrong shape or type.
)");
  module.def("simplified_loop", &py_simplified_loop, py::arg("loop"), py::arg("tolerance"), R"(
Returns a closed loop with fewer points, by the method of Ramer, Douglas and Peucker.

Args:
    loop: Points (x, y) [pixels], shape (n, 2).
    tolerance: Distance [pixels] within which all points of the loop are from the lines between
        the remaining ones. Afterwards, single points are removed that are within 0.71 of this
        distance of the line between their neighbors.

Returns:
    The remaining points in the same order, shape (k, 2).

Raises:
    ValueError: The loop has a wrong shape, or the tolerance is negative or not a number.
)");
}

}  // namespace flatland
