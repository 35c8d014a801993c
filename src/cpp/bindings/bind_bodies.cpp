#include <pybind11/stl.h>

#include <string>
#include <utility>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/named.h"
#include "bindings/tuples.h"
#include "world/bodies.h"
#include "world/motions.h"

namespace py = pybind11;

namespace flatland {
namespace {

struct SavedMotions {
  std::vector<SavedMotion> motions;
};

b2BodyType body_type(const std::string& name) {
  return chosen<b2BodyType>(
      name, "body_type",
      {{"static", b2_staticBody}, {"kinematic", b2_kinematicBody}, {"dynamic", b2_dynamicBody}});
}

const char* type_name(b2BodyType type) {
  if (type == b2_staticBody) return "static";
  return type == b2_kinematicBody ? "kinematic" : "dynamic";
}

// More coordinates, such as those of a geometry_msgs/Vector3, are ignored.
std::pair<double, double> first_two(const Named<std::vector<double>>& vector, const char* name) {
  const std::vector<double>& numbers = vector.as(name);
  if (numbers.size() >= 2) return {numbers[0], numbers[1]};
  throw py::value_error(std::string(name) + " must have two coordinates, got " +
                        std::to_string(numbers.size()));
}

void bind_motion(py::class_<BodyHandle, Handle>& body) {
  body.def_property_readonly(
      "pose", [](const BodyHandle& self) { return to_python(pose_of(self.core(), self.id)); },
      "Pose (x, y, theta) of the origin of the body in the world frame [m, rad].");
  body.def(
      "set_pose",
      [](const BodyHandle& self, Named<double> x, Named<double> y, Named<double> theta) {
        set_pose(self.core(), self.id, {x.as("x"), y.as("y"), theta.as("theta")});
      },
      py::arg("x"), py::arg("y"), py::arg("theta"), R"(
Moves the origin of the body to a pose in the world frame and wakes the body.

Raises:
    ValueError: A number is not finite.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def_property_readonly(
      "velocity",
      [](const BodyHandle& self) { return to_python(velocity_of(self.core(), self.id)); },
      "Velocity (vx, vy, omega) of the origin of the body in the world frame [m/s, rad/s].");
  body.def(
      "set_velocity",
      [](const BodyHandle& self, Named<double> vx, Named<double> vy, Named<double> omega) {
        set_velocity(self.core(), self.id, {vx.as("vx"), vy.as("vy"), omega.as("omega")});
      },
      py::arg("vx"), py::arg("vy"), py::arg("omega"), R"(
Sets the velocity of the origin of the body in the world frame; static bodies ignore it.

Args:
    vx: Velocity along x [m/s].
    vy: Velocity along y [m/s].
    omega: Angular velocity [rad/s].

Raises:
    ValueError: A number is not finite.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def(
      "apply_force",
      [](const BodyHandle& self, const Named<std::vector<double>>& force,
         const Named<std::vector<double>>& point) {
        const auto [fx, fy] = first_two(force, "force");
        const auto [px, py] = first_two(point, "point");
        apply_force(self.core(), self.id, fx, fy, px, py);
      },
      py::arg("force"), py::arg("point"), R"(
Applies a force to a dynamic body during the next step and wakes the body.

Args:
    force: Force in the world frame [N].
    point: Point of application in the world frame [m].

Raises:
    ValueError: A number is not finite, or the force is too large for the mass.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def(
      "apply_torque",
      [](const BodyHandle& self, Named<double> torque) {
        apply_torque(self.core(), self.id, torque.as("torque"));
      },
      py::arg("torque"), R"(
Applies a torque to a dynamic body during the next step and wakes the body.

Args:
    torque: Torque about the z axis [N m].

Raises:
    ValueError: The torque is not finite, or too large for the moment of inertia.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def_property(
      "awake", [](const BodyHandle& self) { return read(self).IsAwake(); },
      [](const BodyHandle& self, Named<bool> awake) {
        const bool is_awake = awake.as("awake");
        self.core().change_body(self.id)->SetAwake(is_awake);
      },
      R"(
Whether the body is awake; settable. Box2D simulates only bodies that are awake.

A body that is put to sleep loses its velocity.
)");
}

void bind_properties(py::class_<BodyHandle, Handle>& body) {
  body.def(
      "destroy", [](const BodyHandle& self) { self.core().destroy_body(self.id); }, R"(
Destroys the body with its fixtures and joints, and ends its contacts.

Raises:
    StaleHandleError: The body has already been destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def(
      "scale_shapes",
      [](const BodyHandle& self, Named<double> factor) {
        scale_shapes(self.core(), self.id, factor.as("factor"));
      },
      py::arg("factor"), R"(
Multiplies the lengths of all shapes by a factor, relative to the origin of the body.

The densities do not change, so that the mass is multiplied by the square of the factor.

Args:
    factor: The factor, from 0.1 to 10.

Raises:
    ValueError: The factor or the resulting mass is out of range, or a shape is an edge.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def_property_readonly(
      "type", [](const BodyHandle& self) { return type_name(read(self).GetType()); },
      "Type of the body, `static`, `kinematic` or `dynamic`.");
  def_reading(body, "mass", &b2Body::GetMass,
              "Mass [kg], 1 for a dynamic body without massive fixtures, 0 if it is not dynamic.");
  def_reading(body, "inertia", &b2Body::GetInertia,
              "Moment of inertia about the origin of the body [kg m^2].");
  def_reading(
      body, "local_center", [](const b2Body& self) { return to_python(self.GetLocalCenter()); },
      "Center of mass in the body frame [m].");
  def_reading(
      body, "world_center", [](const b2Body& self) { return to_python(self.GetWorldCenter()); },
      "Center of mass in the world frame [m].");
  def_reading(body, "linear_damping", &b2Body::GetLinearDamping,
              "Linear damping coefficient [1/s].");
  def_reading(body, "angular_damping", &b2Body::GetAngularDamping,
              "Angular damping coefficient [1/s].");
  body.def_property_readonly(
      "fixtures",
      [](const BodyHandle& self) {
        std::vector<FixtureHandle> fixtures;
        for (const Id id : fixtures_of(self.core(), self.id)) fixtures.emplace_back(self.world, id);
        return fixtures;
      },
      "Fixtures of the body in order of creation.");
  body.def_property_readonly(
      "fixture_ids", [](const BodyHandle& self) { return fixtures_of(self.core(), self.id); },
      "Ids of the fixtures of the body in order of creation.");
  body.def(
      "fixture",
      [](const BodyHandle& self, Id fixture_id) { return FixtureHandle(self.world, fixture_id); },
      py::arg("fixture_id"),
      "Returns the handle of a fixture of the same world by its id, without checking the id.");
  body.def_property_readonly(
      "joints",
      [](const BodyHandle& self) {
        std::vector<JointHandle> joints;
        for (const Id id : joints_of(self.core(), self.id)) joints.emplace_back(self.world, id);
        return joints;
      },
      "Joints attached to the body in order of creation.");
}

void bind_all_bodies(WorldClass& world) {
  world.def(
      "create_body",
      [](const PyWorld& self, const std::string& type, const Named<PyPose>& pose,
         Named<double> linear_damping, Named<double> angular_damping) {
        return BodyHandle(self, create_body(*self.core, body_type(type), pose.as("pose"),
                                            linear_damping.as("linear_damping"),
                                            angular_damping.as("angular_damping")));
      },
      py::arg("body_type"), py::arg("pose"), py::kw_only(), py::arg("linear_damping") = 0.0,
      py::arg("angular_damping") = 0.0, R"(
Creates a body without fixtures, awake and at rest.

Args:
    body_type: Type of the body: `static`, `kinematic` or `dynamic`.
    pose: Pose (x, y, theta) of the origin of the body in the world frame [m, rad].
    linear_damping: Linear damping coefficient, at least 0 [1/s].
    angular_damping: Angular damping coefficient, at least 0 [1/s].

Returns:
    The new body.

Raises:
    ValueError: The type is unknown, a number is not finite, or a damping is negative.
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def(
      "body", [](const PyWorld& self, Id body_id) { return BodyHandle(self, body_id); },
      py::arg("body_id"),
      "Returns the handle of a body by its id, without checking that the body exists.");
  world.def(
      "body_states", [](const World& self) { return to_array(states_of(self)); },
      R"(
Returns the states of all bodies in order of creation, exactly as Box2D stores them.

Returns:
    Position of the origin (x, y) and angle, centre of mass (x, y), velocity of the centre of mass
    (vx, vy, omega), all in the world frame [m, rad, s], and 1 if the body is awake, else 0; shape
    (n, 9).

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def(
      "motions",
      [](const World& self, const Bodies& bodies) {
        const std::vector<Id> ids = ids_in(self, bodies);
        py::array_t<double> rows({ids.size(), std::size_t{6}});
        motions_of(self, ids.data(), ids.size(), rows.mutable_data());
        return rows;
      },
      py::arg("bodies"), R"(
Returns the poses and velocities of the origins of some bodies, in one call.

Args:
    bodies: The bodies.

Returns:
    (x, y, theta, vx, vy, omega) of each body in the world frame [m, rad, s], shape (n, 6).

Raises:
    StaleHandleError: A body was destroyed, or the world is closed.
    WorldLockedError: The world is stepping.
)");
}

void bind_saved_motions(WorldClass& world) {
  // Opaque to Python, hence a class instead of a list.
  py::class_<SavedMotions>(world, "SavedMotions", "Result of `saved_motions`.");
  world.def(
      "saved_motions", [](const World& self) { return SavedMotions{saved_motions(self)}; },
      "Returns the poses, velocities and sleep of all bodies, for `restore_motions`.");
  world.def(
      "restore_motions",
      [](World& self, const SavedMotions& saved) { restore_motions(self, saved.motions); },
      py::arg("saved"), R"(
Restores poses, velocities and sleep bit by bit.

Args:
    saved: Result of `saved_motions`. Bodies that do not exist any more are ignored, and bodies that
        were created since are unchanged.
)");
}

}  // namespace

void bind_bodies(Classes& classes) {
  bind_motion(classes.body);
  bind_properties(classes.body);
  bind_all_bodies(classes.world);
  bind_saved_motions(classes.world);
}

}  // namespace flatland
