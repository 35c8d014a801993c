// Points and poses of Python.
#pragma once

#include <box2d/b2_math.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstddef>
#include <string>
#include <tuple>

#include "world/errors.h"
#include "world/triple.h"

namespace flatland {

// An argument: any sequence of some numbers.
template <std::size_t kCount>
struct Numbers : std::array<double, kCount> {};
using PyPoint = Numbers<2>;
using PyPose = Numbers<3>;

inline b2Vec2 checked_point(const PyPoint& point, const char* what) {
  return checked_vector(point[0], point[1], what);
}

// Results: tuples.
using PyPair = std::tuple<double, double>;
using PyTriple = std::tuple<double, double, double>;

inline PyPair to_python(const b2Vec2& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y)};
}
inline PyTriple to_python(const Triple& t) { return {t[0], t[1], t[2]}; }

}  // namespace flatland

namespace pybind11::detail {

template <std::size_t kCount>
struct type_caster<flatland::Numbers<kCount>> {
  PYBIND11_TYPE_CASTER(flatland::Numbers<kCount>, const_name("collections.abc.Sequence[float]"));

  bool load(handle source, bool convert) {
    if (!isinstance<sequence>(source) || isinstance<str>(source)) return false;
    const auto items = reinterpret_borrow<sequence>(source);
    if (items.size() != kCount) {
      throw value_error("expected " + std::to_string(kCount) + " numbers, got " +
                        std::to_string(items.size()));
    }
    for (std::size_t i = 0; i < kCount; ++i) {
      make_caster<double> number;
      if (!number.load(object(items[i]), convert)) return false;
      value[i] = cast_op<double>(number);
    }
    return true;
  }
};

}  // namespace pybind11::detail
