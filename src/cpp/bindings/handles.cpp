#include "bindings/handles.h"

#include <pybind11/stl.h>

#include <functional>
#include <stdexcept>
#include <string>

#include "bindings/bindings.h"

namespace py = pybind11;

namespace flatland {
namespace {

// The handle that a Python object holds; null while the object is created.
const Handle* handle_of(PyObject* object) {
  auto* instance = reinterpret_cast<py::detail::instance*>(object);
  // A garbage collection can run before pybind11 has chosen the layout of the first instance of a
  // class.
  if (!instance->simple_layout && instance->nonsimple.values_and_holders == nullptr) return nullptr;
  return instance->get_value_and_holder().value_ptr<Handle>();
}

// The class Handle of Python, which exists as long as the module.
PyTypeObject* handle_type = nullptr;

// Lets the garbage collector find reference cycles through handles: a plugin that is called by a
// world may refer to a handle, which refers to the world. Other objects of a cycle break it.
//
// Hashes and comparisons are slots of the type since a call of a bound method takes three times as
// long; handles are keys of dictionaries.
void set_up_type(PyHeapTypeObject* heap_type) {
  PyTypeObject& type = heap_type->ht_type;
  handle_type = &type;
  type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  type.tp_traverse = [](PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    const Handle* handle = handle_of(self);
    if (handle != nullptr) Py_VISIT(handle->world.object.ptr());
    return 0;
  };
  type.tp_hash = [](PyObject* self) {
    const Handle* handle = handle_of(self);
    if (handle == nullptr) return Py_hash_t{0};
    const std::size_t hash =
        std::hash<const World*>()(handle->world.core) ^ std::hash<Id>()(handle->id * 31);
    return static_cast<Py_hash_t>(hash >> 1U);  // -1 is an error
  };
  type.tp_richcompare = [](PyObject* self, PyObject* other, int operation) {
    PyObject* result = Py_NotImplemented;
    if ((operation == Py_EQ || operation == Py_NE) && PyObject_TypeCheck(other, handle_type)) {
      const Handle *left = handle_of(self), *right = handle_of(other);
      const bool is_equal = left != nullptr && right != nullptr && *left == *right;
      result = is_equal == (operation == Py_EQ) ? Py_True : Py_False;
    }
    Py_INCREF(result);
    return result;
  };
}

// Sets the attributes of a handle of a class that is written in Python to deep copies.
void copy_attributes(const py::object& from, const py::object& to, const py::dict& memo) {
  py::object state = from.attr("__getstate__")();
  if (state.is_none()) return;
  state = py::module_::import("copy").attr("deepcopy")(state, memo);
  const py::tuple parts =
      py::isinstance<py::tuple>(state) ? py::tuple(state) : py::make_tuple(state);
  for (const py::handle part : parts) {
    if (part.is_none()) continue;
    for (const auto& [name, value] : py::reinterpret_borrow<py::dict>(part)) {
      py::setattr(to, name, value);
    }
  }
}

py::object deep_copy(const py::object& self, const py::dict& memo) {
  const auto& handle = self.cast<const Handle&>();
  const py::object key = py::module_::import("builtins").attr("id")(handle.world.object);
  if (!memo.contains(key)) return self;
  const py::object type = py::type::of(self);
  const py::object copy = type.attr("__new__")(type);
  memo[py::module_::import("builtins").attr("id")(self)] = copy;
  // The constructor of a class that is written in Python may have other arguments.
  for (const py::handle base : type.attr("__mro__")) {
    if (base.attr("__module__").cast<std::string>() != "flatland._core") continue;
    base.attr("__init__")(copy, memo[key], handle.id);
    break;
  }
  copy_attributes(self, copy, memo);
  return copy;
}

template <typename Class>
void def_constructor(Class& cls) {
  cls.def(py::init<PyWorld, Id>(), py::arg("world"), py::arg("handle_id"), R"(
Creates a handle without checking that the object exists.

Args:
    world: World that contains the object.
    handle_id: Id of the object in the world.
)");
}

bool exists(const BodyHandle& body) { return body.core().has_body(body.id); }
bool exists(const FixtureHandle& fixture) { return fixture.core().has_fixture(fixture.id); }
bool exists(const JointHandle& joint) { return joint.core().has_joint(joint.id); }
bool exists(const TouchesHandle& touches) {
  return touches.core().contacts().touches.find(touches.id) != nullptr;
}
bool exists(const CrowdHandle& crowd) {
  return crowd.core().jobs().find_crowd(crowd.id) != nullptr;
}
bool exists(const ControllerHandle& controller) {
  return controller.core().jobs().find_controller(controller.id) != nullptr;
}

template <typename Class>
void def_alive(Class& cls) {
  using HandleType = typename Class::type;
  cls.def_property_readonly(
      "alive", [](const HandleType& self) { return exists(self); }, "Whether the object exists.");
}

}  // namespace

Classes::Classes(py::module_& module)
    : world(module, "World", R"(
The part of `PhysicsWorld` that calls no functions of Python.
)"),
      handle(module, "Handle", py::custom_type_setup(&set_up_type), R"(
Reference to an object of a physics world, by an id that is unique in the world.

Two handles are equal if they refer to the same object.
)"),
      body(module, "PhysicsBody", R"(
Handle of a rigid body.

All members except `alive` raise `StaleHandleError` once the body is destroyed.
)"),
      fixture(module, "PhysicsFixture", R"(
Handle of a fixture.

All members except `alive` raise `StaleHandleError` once the body of the fixture is destroyed.
)"),
      joint(module, "PhysicsJoint", R"(
Handle of a joint.

All members except `alive` raise `StaleHandleError` once the joint or one of its bodies is
destroyed.
)"),
      touches(module, "Touches", R"(
The contacts of some bodies; created by `PhysicsWorld.collect_touches`.

The core collects them in each step. All members except `alive` raise `StaleHandleError` once the
collector is removed or the world is closed.
)"),
      crowd(module, "Crowd", R"(
Handle of a crowd: people whose bodies the core moves before each step.

It is created by `PhysicsWorld.add_crowd`. Waypoints and routes are identified by numbers. A person
is removed with the body. All members except `alive` raise `StaleHandleError` once the crowd is
removed.
)"),
      controller(module, "Controller", R"(
Handle of a controller, which moves or measures bodies in each step without a call from outside.

It is created by a method of a body or of the world. All members except `alive` raise
`StaleHandleError` once the controller is removed or its body is destroyed.
)"),
      drive(module, "DriveController", R"(
Handle of the controller of a drive, which sets velocities or applies forces.
)"),
      velocity(module, "VelocityController", R"(
Moves the origin of a body with a velocity in the frame of the body, before each step.

A velocity is (forward, sideways, omega) [m/s, rad/s]. It is set in every step, so that friction,
damping and contacts do not slow the body down.
)"),
      tricycle(module, "TricycleController", R"(
Steers and drives the front wheel of a body, which follows without slip, before each step.

The state is (steering angle [rad], steering velocity [rad/s], speed of the front wheel [m/s],
steering angle that the last command required [rad]).
)"),
      ackermann(module, "AckermannController", R"(
Steers and drives a car, which follows without slip, before each step.

The car is a single track: the steering angle is that of a wheel between the front wheels.
)"),
      omni(module, "OmniController", R"(
Moves the origin of a body in all directions, within limits of its wheels.

The velocity (forward, sideways, omega) [m/s, rad/s] changes along a straight line.
)"),
      path(module, "PathController", R"(
Moves a body along waypoints, before and after each step.
)"),
      wheels(module, "WheelsController", R"(
Measures how far wheels roll, after each step.
)"),
      tween(module, "TweenController", R"(
Moves a body between its initial pose and a pose at an offset, before and after each step.
)") {
  const auto def_constructors = [](auto&... each) { (def_constructor(each), ...); };
  def_constructors(body, fixture, joint, touches, crowd, controller, drive, velocity, tricycle,
                   ackermann, omni, path, wheels, tween);
  const auto def_alive_of = [](auto&... each) { (def_alive(each), ...); };
  def_alive_of(body, fixture, joint, touches, crowd, controller);
}

void bind_handles(py::class_<Handle>& handle) {
  handle.def_readonly("id", &Handle::id, "Id of the object, never reused in its world.");
  handle.def_readonly("world", &Handle::world, "Physics world that contains the object.");
  handle.def("__repr__", [](const py::object& self) {
    return py::str("<{} {:#x}>").format(py::type::of(self).attr("__name__"), self.attr("id"));
  });
  handle.def("__copy__", [](const py::object& self) { return self; });
  handle.def("__deepcopy__", &deep_copy, py::arg("memo"), R"(
Returns the handle of the same object in a copy of the world.

Args:
    memo: Copies by the ids of their originals; the handle itself is returned if it does not contain
        the world.
)");
}

Id id_in(const World& world, const Handle& object) {
  if (object.world.core != &world) {
    throw std::invalid_argument("an object belongs to another physics world");
  }
  return object.id;
}

std::vector<Id> ids_in(const World& world, const Bodies& bodies) {
  std::vector<Id> ids;
  for (const py::handle body : bodies) {
    py::detail::make_caster<BodyHandle> caster;
    if (body.is_none() || !caster.load(body, false)) throw py::type_error("expected bodies");
    ids.push_back(id_in(world, py::detail::cast_op<const BodyHandle&>(caster)));
  }
  return ids;
}

std::vector<Id> existing_ids_in(const World& world, const Bodies& bodies) {
  std::vector<Id> ids = ids_in(world, bodies);
  for (const Id id : ids) world.read_body(id);  // throws if it does not exist
  return ids;
}

}  // namespace flatland
