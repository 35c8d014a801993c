// Finds the Python objects that have changed since their contents were saved, and restores them.
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

// Returns the value of a slot, `missing` if it is not set.
py::object slot_of(PyObject* object, PyObject* member, const py::object& missing) {
  PyObject* value =
      Py_TYPE(member)->tp_descr_get(member, object, reinterpret_cast<PyObject*>(Py_TYPE(object)));
  if (value == nullptr) {
    PyErr_Clear();
    return missing;
  }
  return py::reinterpret_steal<py::object>(value);
}

bool are_same_slots(PyObject* object, const py::tuple& members, const py::list& saved,
                    const py::object& missing) {
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto at = static_cast<Py_ssize_t>(i);
    const py::object value = slot_of(object, PyTuple_GET_ITEM(members.ptr(), at), missing);
    if (value.ptr() != PyList_GET_ITEM(saved.ptr(), at)) return false;
  }
  return true;
}

// An object and its saved contents: one of the entries that `restore_contents` describes.
class Entry {
 public:
  explicit Entry(PyObject* entry) : entry_(entry), object_(item(0)) {
    if (item(1) == Py_None) return;
    attributes_ = py::reinterpret_steal<py::object>(PyObject_GenericGetDict(object_, nullptr));
    if (!attributes_) throw py::error_already_set();
  }

  bool is_unchanged(const py::object& missing) const {
    if (attributes_ && !is_same_dict(attributes_.ptr(), item(1), tuple(2))) return false;
    if (!are_same_slots(object_, tuple(3), list(4), missing)) return false;
    if (!is_container()) return true;
    return PyDict_Check(object_) ? is_same_dict(object_, item(5), py::tuple())
                                 : is_same_sequence(object_, item(5));
  }

  bool is_container() const { return item(5) != Py_None; }

  // Writes attributes and slots back.
  void restore(const py::object& missing) const {
    if (attributes_) restore_attributes();
    const py::tuple members = tuple(3);
    const py::list saved = list(4);
    for (std::size_t i = 0; i < members.size(); ++i) {
      const py::object member = members[i];
      PyObject* value = PyList_GET_ITEM(saved.ptr(), static_cast<Py_ssize_t>(i));
      if (value == missing.ptr()) {
        if (slot_of(object_, member.ptr(), missing).is(missing)) continue;
        value = nullptr;  // deletes
      }
      if (Py_TYPE(member.ptr())->tp_descr_set(member.ptr(), object_, value) != 0) {
        throw py::error_already_set();
      }
    }
  }

 private:
  PyObject* item(Py_ssize_t i) const { return PyTuple_GET_ITEM(entry_, i); }
  py::tuple tuple(Py_ssize_t i) const { return py::reinterpret_borrow<py::tuple>(item(i)); }
  py::list list(Py_ssize_t i) const { return py::reinterpret_borrow<py::list>(item(i)); }

  void restore_attributes() const {
    PyObject* current = attributes_.ptr();
    const py::tuple ignored = tuple(2);
    const auto names = py::reinterpret_steal<py::list>(PyDict_Keys(current));
    for (const py::handle name : names) {
      if (PyDict_Contains(item(1), name.ptr()) == 0 && !contains(ignored, name.ptr()) &&
          PyDict_DelItem(current, name.ptr()) != 0) {
        throw py::error_already_set();
      }
    }
    PyObject *name = nullptr, *value = nullptr;
    Py_ssize_t at = 0;
    while (PyDict_Next(item(1), &at, &name, &value) != 0) {
      if (PyDict_GetItemWithError(current, name) != value &&
          PyDict_SetItem(current, name, value) != 0) {
        throw py::error_already_set();
      }
    }
  }

  PyObject* entry_;
  PyObject* object_;
  py::object attributes_;  // null if they are not saved
};

}  // namespace

void bind_copying(py::module_& module) {
  module.def(
      "restore_contents",
      [](const std::vector<py::tuple>& entries, const py::object& missing) {
        std::vector<std::size_t> changed;
        for (std::size_t i = 0; i < entries.size(); ++i) {
          if (entries[i].size() != kMembers) {
            throw py::value_error("an entry must have " + std::to_string(kMembers) + " members");
          }
          const Entry entry(entries[i].ptr());
          if (entry.is_unchanged(missing)) continue;
          if (entry.is_container()) {
            changed.push_back(i);
          } else {
            entry.restore(missing);
          }
        }
        return changed;
      },
      py::arg("entries"), py::arg("missing"), R"(
Writes the attributes of objects back that are not the same objects as earlier.

Args:
    entries: For each object a tuple: the object; a copy of its `__dict__`, or None if it has none;
        the names of attributes that are ignored; the descriptors of its slots; a list of their
        values; a copy of its items, None if it is not a container. The items of a dict are in a
        dict.
    missing: Value of a slot that is not set.

Returns:
    The indices of the containers that have changed, of which nothing is written.

Raises:
    ValueError: An entry has another number of members.
)");
}

}  // namespace flatland
