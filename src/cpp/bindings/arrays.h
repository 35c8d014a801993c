// Arrays of numpy as arguments and results.
#pragma once

#include <box2d/b2_math.h>
#include <pybind11/numpy.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace flatland {

// An argument, converted if necessary.
template <typename Scalar>
using Array = pybind11::array_t<Scalar, pybind11::array::c_style | pybind11::array::forcecast>;

// Throws a ValueError unless the array is a table with some columns.
inline void check_shape(const pybind11::array& array, pybind11::ssize_t columns,
                        const std::string& name) {
  if (array.ndim() == 2 && array.shape(1) == columns) return;
  throw pybind11::value_error(name + " must have shape (n, " + std::to_string(columns) + "), got " +
                              std::string(pybind11::str(array.attr("shape"))));
}

inline pybind11::array_t<double> to_array(const float* values, std::size_t count) {
  pybind11::array_t<double> array(static_cast<pybind11::ssize_t>(count));
  std::copy_n(values, count, array.mutable_data());
  return array;
}

inline pybind11::array_t<double> to_array(const b2Vec2& vector) {
  const float values[] = {vector.x, vector.y};
  return to_array(values, 2);
}

inline pybind11::array_t<double> to_array(const b2Vec2* points, std::size_t count) {
  pybind11::array_t<double> array({count, std::size_t{2}});
  double* values = array.mutable_data();
  for (std::size_t i = 0; i < count; ++i) {
    *values++ = static_cast<double>(points[i].x);
    *values++ = static_cast<double>(points[i].y);
  }
  return array;
}

template <typename Scalar, std::size_t kWidth>
pybind11::array_t<Scalar> to_array(const std::vector<std::array<Scalar, kWidth>>& rows) {
  pybind11::array_t<Scalar> array({rows.size(), kWidth});
  if (!rows.empty()) {
    std::copy_n(rows.front().data(), rows.size() * kWidth, array.mutable_data());
  }
  return array;
}

}  // namespace flatland
