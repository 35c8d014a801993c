#include <exception>
#include <string>

#include "bindings/bindings.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

// The classes are imported on demand, so that no global variable references them.
void raise(const char* class_name, const std::exception& error) {
  const py::object type = py::module_::import("flatland.errors").attr(class_name);
  PyErr_SetString(type.ptr(), error.what());
}

void translate(std::exception_ptr pointer) {
  try {
    std::rethrow_exception(pointer);
  } catch (const StaleHandleError& error) {
    raise("StaleHandleError", error);
  } catch (const WorldLockedError& error) {
    raise("WorldLockedError", error);
  } catch (const PhysicsError& error) {
    raise("PhysicsError", error);
  }
}

}  // namespace

void bind_errors() { py::register_local_exception_translator(&translate); }

std::uint16_t checked_bits(std::int64_t bits, const char* what) {
  if (bits < 0 || bits > 0xFFFF) {
    throw py::value_error(std::string(what) + " must be from 0 to 65535, got " +
                          std::to_string(bits));
  }
  return static_cast<std::uint16_t>(bits);
}

}  // namespace flatland
