// Arguments whose errors name them.
//
// pybind11 does not name an argument that it cannot convert. A `Named` argument accepts every
// object; the function passes the name where it takes the value.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "bindings/tuples.h"

namespace flatland {

// What an argument must be, for errors.
template <typename Value>
inline constexpr const char* kExpected = nullptr;
template <>
inline constexpr const char* kExpected<bool> = "true or false";
template <>
inline constexpr const char* kExpected<std::int64_t> = "an integer";
template <>
inline constexpr const char* kExpected<std::vector<double>> = "a sequence of numbers";
template <>
inline constexpr const char* kExpected<PyPoint> = "two numbers";
template <>
inline constexpr const char* kExpected<PyPose> = "three numbers";
template <>
inline constexpr const char* kExpected<std::optional<std::pair<double, double>>> =
    "two numbers or None";

template <typename Value>
class Named {
 public:
  Named() = default;
  explicit Named(Value value) : value_(std::move(value)) {}
  explicit Named(pybind11::handle invalid) : invalid_(invalid) {}

  // Returns the value. Throws an exception with the name of the argument if it is invalid.
  std::conditional_t<std::is_arithmetic_v<Value>, Value, const Value&> as(const char* name) const {
    if (!invalid_) return value_;
    const auto checks = pybind11::module_::import("flatland.checks");
    if constexpr (std::is_same_v<Value, double>) {
      return checks.attr("checked_number")(name, invalid_).template cast<double>();
    } else {
      const auto shown = checks.attr("shown")(invalid_).template cast<std::string>();
      throw pybind11::value_error(std::string(name) + " must be " + kExpected<Value> + ", got " +
                                  shown);
    }
  }

 private:
  Value value_{};
  pybind11::handle invalid_;  // an argument of the call, which outlives this object
};

}  // namespace flatland

namespace pybind11::detail {

template <typename Value>
struct type_caster<flatland::Named<Value>> {
  PYBIND11_TYPE_CASTER(flatland::Named<Value>, make_caster<Value>::name);

  bool load(handle source, bool convert) {
    if constexpr (std::is_same_v<Value, double>) {
      if (PyFloat_CheckExact(source.ptr())) {
        value = flatland::Named<Value>(PyFloat_AS_DOUBLE(source.ptr()));
        return true;
      }
    }
    value = flatland::Named<Value>(source);
    // The conversion of NumPy discards the imaginary part.
    if (PyComplex_Check(source.ptr())) return true;
    try {
      make_caster<Value> caster;
      if (caster.load(source, convert)) {
        value = flatland::Named<Value>(cast_op<Value>(std::move(caster)));
      }
    } catch (const value_error&) {  // a sequence with another number of items
    }
    return true;
  }
};

}  // namespace pybind11::detail
