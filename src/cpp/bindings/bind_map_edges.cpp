#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cfloat>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "bindings/masks.h"
#include "maps/map_edges.h"

namespace py = pybind11;

namespace flatland {

py::array checked_mask(const py::array& mask) {
  const bool is_byte =
      mask.itemsize() == 1 && (mask.dtype().kind() == 'b' || mask.dtype().kind() == 'u');
  if (mask.ndim() != 2 || !is_byte) {
    throw py::value_error("mask must be a two-dimensional array of bool or uint8, got " +
                          std::string(py::str(mask.dtype())) + " with shape " +
                          std::string(py::str(mask.attr("shape"))));
  }
  for (py::ssize_t axis = 0; axis < 2; ++axis) {
    if (static_cast<std::size_t>(mask.shape(axis)) > kMaxBitmapSide) {
      throw py::value_error("mask must have fewer than 2^31 - 16 rows and columns, got shape " +
                            std::string(py::str(mask.attr("shape"))));
    }
  }
  py::array contiguous = py::array::ensure(mask, py::array::c_style);
  if (!contiguous) throw std::bad_alloc();  // the only possible failure of a copy of bytes
  return contiguous;
}

Bitmap view_of(const py::array& mask) {
  return {static_cast<const std::uint8_t*>(mask.data()), static_cast<std::size_t>(mask.shape(0)),
          static_cast<std::size_t>(mask.shape(1))};
}

namespace {

// Converts rows to an array without a copy; the array owns the vector.
template <typename Scalar, typename Row>
py::array_t<Scalar> table_of(std::vector<Row> rows) {
  constexpr std::size_t width = sizeof(Row) / sizeof(Scalar);
  static_assert(sizeof(Row) == width * sizeof(Scalar), "rows must be packed");
  auto owned = std::make_unique<std::vector<Row>>(std::move(rows));
  const std::vector<Row>& kept = *owned;
  py::capsule owner(owned.get(), [](void* data) { delete static_cast<std::vector<Row>*>(data); });
  owned.release();
  return py::array_t<Scalar>({kept.size(), width}, reinterpret_cast<const Scalar*>(kept.data()),
                             owner);
}

py::array_t<float> py_boundary_edges(const py::array& mask, double resolution) {
  const py::array pixels = checked_mask(mask);
  const Bitmap bitmap = view_of(pixels);
  const auto longest = static_cast<double>(std::max(bitmap.rows, bitmap.cols));
  if (!(resolution >= static_cast<double>(FLT_MIN)) ||
      resolution * longest > static_cast<double>(FLT_MAX)) {
    throw py::value_error(
        "resolution must be positive and the size of the map in the range of a 32-bit float, got " +
        std::string(py::repr(py::float_(resolution))));
  }
  std::vector<BoundaryEdge> edges;
  {
    // Safe without the GIL: `pixels` keeps the memory alive, and no Python object is accessed.
    py::gil_scoped_release unlocked;
    edges = boundary_edges(bitmap, resolution);
  }
  return table_of<float>(std::move(edges));
}

std::vector<py::array_t<std::int32_t>> py_boundary_loops(const py::array& mask) {
  const py::array pixels = checked_mask(mask);
  const Bitmap bitmap = view_of(pixels);
  BoundaryLoops loops;
  {
    // Safe without the GIL: `pixels` keeps the memory alive, and no Python object is accessed.
    py::gil_scoped_release unlocked;
    loops = boundary_loops(bitmap);
  }
  const auto points = table_of<std::int32_t>(std::move(loops.points));
  std::vector<py::array_t<std::int32_t>> views;
  for (std::size_t i = 0; i + 1 < loops.starts.size(); ++i) {
    const auto count = static_cast<py::ssize_t>(loops.starts[i + 1] - loops.starts[i]);
    views.emplace_back(py::array::ShapeContainer{count, py::ssize_t{2}},
                       points.data(static_cast<py::ssize_t>(loops.starts[i]), 0), points);
  }
  return views;
}

}  // namespace

void bind_map_edges(py::module_& module) {
  module.def("boundary_edges", &py_boundary_edges, py::arg("mask"), py::arg("resolution"), R"(
Returns the exact boundary between the on and off pixels of a bitmap as straight edges.

All pixels outside the bitmap are on. The corners of pixels have integer coordinates: x counts
columns from the left edge, y counts rows upwards from the bottom edge. Multiplied by the
resolution, they are coordinates in the frame of the body of a layer.

Each edge is a maximal straight run between pixels that differ, horizontal between two rows or
vertical between two columns. A run continues through a corner at which only diagonally adjacent
pixels are equal.

Args:
    mask: Pixels with the top row first, on where non-zero; shape (rows, columns), bool or uint8.
    resolution: Size of a pixel [m].

Returns:
    Edges (x1, y1, x2, y2) relative to the lower left corner of the bitmap [m], shape (n, 4). The
    order depends only on the bitmap.

Raises:
    ValueError: The mask has a wrong shape or type, or the resolution is not positive, or a
        coordinate is outside the range of a 32-bit float.
)");
  module.def("boundary_loops", &py_boundary_loops, py::arg("mask"), R"(
Returns the boundary of `boundary_edges` as closed loops.

On pixels lie to the left of a loop. Two on pixels are connected only through a common side, so at a
corner where four sides of the boundary meet, the sides of each on pixel belong together.

Args:
    mask: Pixels with the top row first, on where non-zero; shape (rows, columns), bool or uint8.

Returns:
    For each loop, the pixel corners (x, y) at which it turns, shape (k, 2) with k even and at least
    4, starting at its topmost, then leftmost corner. The loops are sorted by their first corners,
    from the top.

Raises:
    ValueError: The mask has a wrong shape or type.
)");
}

}  // namespace flatland
