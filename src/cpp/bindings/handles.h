// Handles: Python objects that refer to an object of a world by its id.
//
// A class of handles is derived from `Handle`. All classes are registered before the first method
// is defined, since the signatures in docstrings contain the names of the classes.
#pragma once

#include <pybind11/pybind11.h>

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "world/world.h"

namespace flatland {

// A PhysicsWorld of Python, as an argument or a result. It keeps the Python object alive.
struct PyWorld {
  pybind11::object object;
  World* core = nullptr;  // owned by `object`
};

// A reference to an object of a world. The object may have been destroyed: each use of the id
// checks its generation, and throws StaleHandleError.
struct Handle {
  Handle(PyWorld given_world, Id given_id) : world(std::move(given_world)), id(given_id) {}

  World& core() const { return *world.core; }
  bool operator==(const Handle& other) const {
    return id == other.id && world.core == other.world.core;
  }

  PyWorld world;
  Id id;
};

// A class of handles; the tag only distinguishes the class from others.
template <typename Tag, typename Base = Handle>
struct HandleOf : Base {
  using Base::Base;
};

using BodyHandle = HandleOf<struct BodyTag>;
using FixtureHandle = HandleOf<struct FixtureTag>;
using JointHandle = HandleOf<struct JointTag>;
using TouchesHandle = HandleOf<struct TouchesTag>;
using CrowdHandle = HandleOf<struct CrowdTag>;
using ControllerHandle = HandleOf<struct ControllerTag>;
using DriveHandle = HandleOf<struct DriveTag, ControllerHandle>;
using VelocityHandle = HandleOf<struct VelocityTag, DriveHandle>;
using TricycleHandle = HandleOf<struct TricycleTag, DriveHandle>;
using AckermannHandle = HandleOf<struct AckermannTag, DriveHandle>;
using OmniHandle = HandleOf<struct OmniTag, DriveHandle>;
using PathHandle = HandleOf<struct PathTag, ControllerHandle>;
using WheelsHandle = HandleOf<struct WheelsTag, ControllerHandle>;
using TweenHandle = HandleOf<struct TweenTag, ControllerHandle>;

// The classes of Python objects that refer to a world.
struct Classes {
  explicit Classes(pybind11::module_& module);

  pybind11::class_<World, std::shared_ptr<World>> world;
  pybind11::class_<Handle> handle;
  pybind11::class_<BodyHandle, Handle> body;
  pybind11::class_<FixtureHandle, Handle> fixture;
  pybind11::class_<JointHandle, Handle> joint;
  pybind11::class_<TouchesHandle, Handle> touches;
  pybind11::class_<CrowdHandle, Handle> crowd;
  pybind11::class_<ControllerHandle, Handle> controller;
  pybind11::class_<DriveHandle, ControllerHandle> drive;
  pybind11::class_<VelocityHandle, DriveHandle> velocity;
  pybind11::class_<TricycleHandle, DriveHandle> tricycle;
  pybind11::class_<AckermannHandle, DriveHandle> ackermann;
  pybind11::class_<OmniHandle, DriveHandle> omni;
  pybind11::class_<PathHandle, ControllerHandle> path;
  pybind11::class_<WheelsHandle, ControllerHandle> wheels;
  pybind11::class_<TweenHandle, ControllerHandle> tween;
};

// Any number of bodies, as an argument.
struct Bodies : pybind11::iterable {
  using pybind11::iterable::iterable;
};

// Returns the id of an object; throws std::invalid_argument if it belongs to another world.
Id id_in(const World& world, const Handle& object);
std::vector<Id> ids_in(const World& world, const Bodies& bodies);
// The same; throws StaleHandleError if a body was destroyed.
std::vector<Id> existing_ids_in(const World& world, const Bodies& bodies);

// The object of a handle, for reading.
inline const b2Body& read(const BodyHandle& body) { return *body.core().read_body(body.id); }
inline const b2Fixture& read(const FixtureHandle& fixture) {
  return *fixture.core().read_fixture(fixture.id);
}
inline const JointRecord& read(const JointHandle& joint) {
  return joint.core().read_joint(joint.id);
}

// Defines a property that cannot be set: a member of the object of a handle, or a function of it.
template <typename Class, typename Get>
void def_reading(Class& cls, const char* name, Get get, const char* doc) {
  using HandleType = typename Class::type;
  cls.def_property_readonly(
      name, [get](const HandleType& self) { return std::invoke(get, read(self)); }, doc);
}

}  // namespace flatland

namespace pybind11::detail {

template <>
struct type_caster<flatland::PyWorld> {
  PYBIND11_TYPE_CASTER(flatland::PyWorld, const_name("flatland.physics.PhysicsWorld"));

  bool load(handle source, bool convert) {
    type_caster_base<flatland::World> caster;
    if (source.is_none() || !caster.load(source, convert)) return false;
    value = {reinterpret_borrow<object>(source), static_cast<flatland::World*>(caster)};
    return true;
  }
  static handle cast(const flatland::PyWorld& world, return_value_policy, handle) {
    return world.object.inc_ref();
  }
};

template <>
struct handle_type_name<flatland::Bodies> {
  static constexpr auto name = const_name("collections.abc.Iterable[flatland._core.PhysicsBody]");
};

}  // namespace pybind11::detail
