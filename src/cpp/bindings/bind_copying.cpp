// Which Python objects have changed since their contents were saved.
#include <pybind11/stl.h>

#include <cstddef>
#include <string>
#include <vector>

#include "bindings/bindings.h"

namespace py = pybind11;

namespace flatland {
namespace {

// Members of an entry.
constexpr std::size_t kMembers = 6;

bool contains(const py::tuple& names, PyObject* name) {
  for (const py::handle each : names) {
    if (each.ptr() == name) return true;
  }
  return false;
}

// Returns whether two dictionaries contain the same objects in the same order, apart from keys of
// the first one that are ignored.
bool is_same_dict(PyObject* current, PyObject* saved, const py::tuple& ignored) {
  PyObject *key = nullptr, *value = nullptr, *saved_key = nullptr, *saved_value = nullptr;
  Py_ssize_t at = 0, saved_at = 0;
  while (PyDict_Next(saved, &saved_at, &saved_key, &saved_value) != 0) {
    do {
      if (PyDict_Next(current, &at, &key, &value) == 0) return false;
    } while (contains(ignored, key));
    if (key != saved_key || value != saved_value) return false;
  }
  while (PyDict_Next(current, &at, &key, &value) != 0) {
    if (!contains(ignored, key)) return false;
  }
  return true;
}

// Returns whether two containers, neither of which is a dictionary, contain the same objects in the
// same order.
bool is_same_sequence(const py::handle& current, const py::handle& saved) {
  const Py_ssize_t size = PyObject_Size(saved.ptr());
  if (PyObject_Size(current.ptr()) != size) return false;
  if (size == 0) return true;
  py::iterator other = py::iter(saved);
  for (const py::handle item : current) {
    if (item.ptr() != other->ptr()) return false;
    ++other;
  }
  return true;
}

bool are_same_slots(PyObject* object, const py::tuple& members, const py::list& saved,
                    const py::object& missing) {
  for (std::size_t i = 0; i < members.size(); ++i) {
    PyObject* member = PyTuple_GET_ITEM(members.ptr(), static_cast<Py_ssize_t>(i));
    PyObject* value =
        Py_TYPE(member)->tp_descr_get(member, object, reinterpret_cast<PyObject*>(Py_TYPE(object)));
    if (value == nullptr) {
      PyErr_Clear();
      value = missing.inc_ref().ptr();
    }
    const bool is_same = value == PyList_GET_ITEM(saved.ptr(), static_cast<Py_ssize_t>(i));
    Py_DECREF(value);
    if (!is_same) return false;
  }
  return true;
}

// Examines one of the entries that `changed_contents` describes.
bool is_unchanged(const py::tuple& entry, const py::object& missing) {
  const auto item = [&](Py_ssize_t i) { return PyTuple_GET_ITEM(entry.ptr(), i); };
  const auto tuple = [&](Py_ssize_t i) { return py::reinterpret_borrow<py::tuple>(item(i)); };
  PyObject* object = item(0);
  if (item(1) != Py_None) {
    const auto attributes =
        py::reinterpret_steal<py::object>(PyObject_GenericGetDict(object, nullptr));
    if (!attributes) throw py::error_already_set();
    if (!is_same_dict(attributes.ptr(), item(1), tuple(2))) return false;
  }
  if (!are_same_slots(object, tuple(3), py::reinterpret_borrow<py::list>(item(4)), missing)) {
    return false;
  }
  if (item(5) == Py_None) return true;
  return PyDict_Check(object) ? is_same_dict(object, item(5), py::tuple())
                              : is_same_sequence(object, item(5));
}

}  // namespace

void bind_copying(py::module_& module) {
  module.def(
      "changed_contents",
      [](const std::vector<py::tuple>& entries, const py::object& missing) {
        std::vector<std::size_t> changed;
        for (std::size_t i = 0; i < entries.size(); ++i) {
          if (entries[i].size() != kMembers) {
            throw py::value_error("an entry must have " + std::to_string(kMembers) + " members");
          }
          if (!is_unchanged(entries[i], missing)) changed.push_back(i);
        }
        return changed;
      },
      py::arg("entries"), py::arg("missing"), R"(
Returns the indices of the objects whose contents are not the same objects as earlier.

Args:
    entries: For each object a tuple: the object; a copy of its `__dict__`, or None if it has none;
        the names of attributes that are ignored; the descriptors of its slots; a list of their
        values; a copy of its items, None if it is not a container. The items of a dict are in a
        dict.
    missing: Value of a slot that is not set.

Raises:
    ValueError: An entry has another number of members.
)");
}

}  // namespace flatland
