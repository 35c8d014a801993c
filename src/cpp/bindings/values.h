// Values of classes of flatland.physics.values, which are written in Python.
#pragma once

#include <pybind11/pybind11.h>

#include <utility>

namespace flatland {

// A value of the class with a name.
template <const auto& kName>
struct PyValue : pybind11::object {
  static constexpr const char* kClass = kName;
};

inline constexpr char kMaterialClass[] = "Material";
using PyMaterial = PyValue<kMaterialClass>;
inline constexpr char kObjectCountsClass[] = "ObjectCounts";
using PyObjectCounts = PyValue<kObjectCountsClass>;
inline constexpr char kPathStateClass[] = "PathState";
using PyPathState = PyValue<kPathStateClass>;
inline constexpr char kPersonStateClass[] = "PersonState";
using PyPersonState = PyValue<kPersonStateClass>;
inline constexpr char kWorkTimesClass[] = "WorkTimes";
using PyWorkTimes = PyValue<kWorkTimesClass>;
inline constexpr char kRayHitClass[] = "RayHit";
using PyRayHit = PyValue<kRayHitClass>;
inline constexpr char kScanClass[] = "Scan";
using PyScan = PyValue<kScanClass>;
inline constexpr char kLabelledScanClass[] = "LabelledScan";
using PyLabelledScan = PyValue<kLabelledScanClass>;
inline constexpr char kTouchClass[] = "Touch";
using PyTouch = PyValue<kTouchClass>;

// Several values of the class with a name, as an argument.
template <const auto& kName>
struct PyValues : pybind11::sequence {
  using pybind11::sequence::sequence;
};

inline constexpr char kRollingWheelClass[] = "RollingWheel";
using PyWheels = PyValues<kRollingWheelClass>;
inline constexpr char kMemberClass[] = "Member";
using PyMembers = PyValues<kMemberClass>;

// Creates a value; `Value` is the PyValue of its class.
template <typename Value, typename... Args>
Value make_value(Args&&... args) {
  // An import takes longer than many queries. The class is never released, since this variable is
  // destroyed after the interpreter.
  static PyObject* cls = nullptr;
  if (cls == nullptr) {
    const auto module = pybind11::module_::import("flatland.physics.values");
    cls = pybind11::object(module.attr(Value::kClass)).release().ptr();
  }
  return Value{pybind11::handle(cls)(std::forward<Args>(args)...)};
}

}  // namespace flatland

namespace pybind11::detail {

template <const auto& kName>
struct handle_type_name<flatland::PyValue<kName>> {
  static constexpr auto name = const_name("flatland.physics.") + const_name(kName);
};
template <const auto& kName>
struct handle_type_name<flatland::PyValues<kName>> {
  static constexpr auto name = const_name("collections.abc.Sequence[flatland.physics.") +
                               const_name(kName) + const_name("]");
};

}  // namespace pybind11::detail
