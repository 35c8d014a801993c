#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cfloat>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "maps/map_edges.h"

namespace py = pybind11;

namespace flatland {
namespace {

// Checks the shape and type of a mask and returns it in C order, without a copy if possible.
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

// Converts rows to an array without a copy; the array owns the vector.
template <typename Scalar, typename Row>
py::array_t<Scalar> to_array(std::vector<Row> rows) {
  constexpr std::size_t width = sizeof(Row) / sizeof(Scalar);
  static_assert(sizeof(Row) == width * sizeof(Scalar), "rows must be packed");
  auto owned = std::make_unique<std::vector<Row>>(std::move(rows));
  const std::vector<Row>& kept = *owned;
  py::capsule owner(owned.get(), [](void* data) { delete static_cast<std::vector<Row>*>(data); });
  owned.release();
  const auto count = static_cast<py::ssize_t>(kept.size());
  const auto* data = reinterpret_cast<const Scalar*>(kept.data());
  if (width == 1) return py::array_t<Scalar>({count}, data, owner);
  return py::array_t<Scalar>({count, static_cast<py::ssize_t>(width)}, data, owner);
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
  return to_array<float>(std::move(edges));
}

py::tuple py_boundary_loops(const py::array& mask) {
  const py::array pixels = checked_mask(mask);
  const Bitmap bitmap = view_of(pixels);
  BoundaryLoops loops;
  {
    // Safe without the GIL: `pixels` keeps the memory alive, and no Python object is accessed.
    py::gil_scoped_release unlocked;
    loops = boundary_loops(bitmap);
  }
  return py::make_tuple(to_array<std::int32_t>(std::move(loops.points)),
                        to_array<std::int64_t>(std::move(loops.starts)));
}

}  // namespace

void bind_map_edges(py::module_& module) {
  module.def("boundary_edges", &py_boundary_edges, py::arg("mask"), py::arg("resolution"),
             "Returns the boundary between on and off pixels as straight edges [m], shape (n, 4).");
  module.def("boundary_loops", &py_boundary_loops, py::arg("mask"),
             "Returns the boundary as loops: corners (n, 2) and the start of each loop (m + 1,).");
}

}  // namespace flatland
