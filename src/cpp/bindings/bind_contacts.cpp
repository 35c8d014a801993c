#include <box2d/b2_collision.h>
#include <box2d/b2_contact.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <unordered_set>
#include <utility>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/named.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

// The contact passed to a pre-solve hook. Python code may store a reference beyond the call, but
// can access the Box2D contact only during the call.
class PreSolveContact {
 public:
  PreSolveContact(b2Contact* contact, const ContactRow& row) : contact_(contact), row_(row) {}

  void expire() { contact_ = nullptr; }
  const ContactRow& row() const { return row_; }
  b2Contact& contact() const {
    if (contact_ == nullptr) {
      throw StaleHandleError(
          "a contact can be accessed only during the call of pre_solve that received it");
    }
    return *contact_;
  }

 private:
  b2Contact* contact_;
  ContactRow row_;
};

// The manifold of the previous step, in the local frames of the two bodies.
struct OldManifold {
  // Box2D does not initialize the other members of a manifold without points.
  explicit OldManifold(const b2Manifold& given)
      : manifold(given.pointCount > 0 ? given : b2Manifold{}) {}

  std::size_t count() const { return static_cast<std::size_t>(manifold.pointCount); }

  b2Manifold manifold;
};

class PythonHook final : public PreSolveHook {
 public:
  PythonHook(py::function callback, std::unordered_set<Id> bodies, py::list errors)
      : callback_(std::move(callback)), bodies_(std::move(bodies)), errors_(std::move(errors)) {}

  bool wants(Id body) const noexcept override { return bodies_.count(body) != 0; }

  void pre_solve(b2Contact* contact, const ContactRow& row,
                 const b2Manifold& old_manifold) noexcept override {
    const py::gil_scoped_acquire locked;
    try {
      const auto argument = std::make_shared<PreSolveContact>(contact, row);
      try {
        callback_(argument, OldManifold(old_manifold));
      } catch (py::error_already_set& error) {
        store(error);
      }
      argument->expire();
    } catch (const std::exception&) {
      // Not enough memory to store the error, so it cannot be reported.
      PyErr_Clear();
    }
  }

 private:
  void store(py::error_already_set& error) {
    if (error.trace()) PyException_SetTraceback(error.value().ptr(), error.trace().ptr());
    errors_.append(error.value());
  }

  py::function callback_;
  std::unordered_set<Id> bodies_;
  py::list errors_;
};

std::optional<PyReport> step_with_hook(World& world, double dt, int velocity_iterations,
                                       int position_iterations, py::function callback,
                                       std::unordered_set<Id> bodies, py::list errors) {
  PythonHook hook(std::move(callback), std::move(bodies), std::move(errors));
  // Safe without the GIL: the world is in exclusive use by this thread, and the hook holds the GIL
  // while it accesses Python objects.
  World::ExclusiveUse use(world, World::kStepping);
  return to_python(without_gil(
      use, [&] { return world.step(dt, velocity_iterations, position_iterations, &hook); }));
}

// A contact event, or a contact that exists now.
struct ContactEvent {
  ContactRow row;
};
struct ContactInfo {
  ContactRow row;
};

template <typename Contact>
std::vector<Contact> to_contacts(const std::vector<ContactRow>& rows) {
  std::vector<Contact> contacts;
  for (const ContactRow& row : rows) contacts.push_back({row});
  return contacts;
}

const char* kind_name(ContactKind kind) {
  if (kind == ContactKind::kBegin) return "begin";
  return kind == ContactKind::kEnd ? "end" : "post_solve";
}

// Binds what all contacts have; row_of(contact) returns the row.
template <typename Class, typename RowOf>
void bind_row(Class& contact, RowOf row_of) {
  using Contact = typename Class::type;
  const auto bind_id = [&](const char* name, Id ContactRow::*id, const char* doc) {
    contact.def_property_readonly(
        name, [=](const Contact& self) { return row_of(self).*id; }, doc);
  };
  bind_id("contact_id", &ContactRow::contact_id,
          "Id of the contact, the same for as long as the two fixtures touch.");
  bind_id("fixture_a", &ContactRow::fixture_a, "Id of the first fixture.");
  bind_id("fixture_b", &ContactRow::fixture_b, "Id of the second fixture.");
  bind_id("body_a", &ContactRow::body_a, "Id of the body of the first fixture.");
  bind_id("body_b", &ContactRow::body_b, "Id of the body of the second fixture.");
  contact.def_property_readonly(
      "points",
      [=](const Contact& self) { return to_array(row_of(self).points, row_of(self).point_count); },
      R"(
Contact points, world frame [m], shape (k, 2), k from 0 to 2.

Empty for sensors and for shapes that no longer touch.
)");
  contact.def_property_readonly(
      "normal", [=](const Contact& self) { return to_array(row_of(self).normal); },
      "Unit vector from A to B, world frame, shape (2,); zero without points.");
  contact.def_property_readonly(
      "is_sensor", [=](const Contact& self) { return row_of(self).is_sensor; },
      "Whether one of the fixtures is a sensor.");
}

void bind_recorded_contacts(py::module_& module) {
  py::class_<ContactEvent> event(module, "ContactEvent", R"(
A contact event between two fixtures, with the state of the contact at that moment.
)");
  bind_row(event, [](const ContactEvent& self) -> const ContactRow& { return self.row; });
  event.def_property_readonly(
      "kind", [](const ContactEvent& self) { return kind_name(self.row.kind); },
      "Kind of the event: `begin`, `end` or `post_solve`.");
  const auto bind_impulses = [&](const char* name, const auto impulses, const char* doc) {
    event.def_property_readonly(
        name,
        [=](const ContactEvent& self) {
          return to_array(self.row.*impulses, self.row.point_count);
        },
        doc);
  };
  bind_impulses("normal_impulses", &ContactRow::normal_impulses, R"(
Impulse along the normal at each point [N s], shape (k,).

Zero unless the kind is `post_solve`.
)");
  bind_impulses("tangent_impulses", &ContactRow::tangent_impulses, R"(
Impulse along the surface at each point [N s], shape (k,).

Zero unless the kind is `post_solve`.
)");
  py::class_<ContactInfo> info(module, "ContactInfo",
                               "A contact of two fixtures that currently touch.");
  bind_row(info, [](const ContactInfo& self) -> const ContactRow& { return self.row; });
}

void bind_pre_solve_contact(py::module_& module) {
  py::class_<PreSolveContact, std::shared_ptr<PreSolveContact>> contact(module, "PreSolveContact",
                                                                        R"(
A contact before it is solved.

The attributes that can be set, and only those, expire after the call of `pre_solve`.
)");
  bind_row(contact, [](const PreSolveContact& self) -> const ContactRow& { return self.row(); });
  contact.def_property(
      "enabled", [](const PreSolveContact& self) { return self.contact().IsEnabled(); },
      [](PreSolveContact& self, Named<bool> enabled) {
        self.contact().SetEnabled(enabled.as("enabled"));
      },
      "Whether the solver separates the fixtures in this step.");
  contact.def_property(
      "friction", [](const PreSolveContact& self) { return self.contact().GetFriction(); },
      [](PreSolveContact& self, Named<double> friction) {
        self.contact().SetFriction(checked_not_negative(friction.as("friction"), "friction"));
      },
      "Friction coefficient of the contact.");
  contact.def_property(
      "restitution", [](const PreSolveContact& self) { return self.contact().GetRestitution(); },
      [](PreSolveContact& self, Named<double> restitution) {
        self.contact().SetRestitution(
            checked_not_negative(restitution.as("restitution"), "restitution"));
      },
      "Restitution coefficient of the contact.");
  contact.def_property(
      "tangent_speed", [](const PreSolveContact& self) { return self.contact().GetTangentSpeed(); },
      [](PreSolveContact& self, Named<double> speed) {
        self.contact().SetTangentSpeed(checked_finite(speed.as("tangent_speed"), "tangent_speed"));
      },
      "Speed of the surface along the tangent [m/s], as for a conveyor belt.");
}

void bind_old_manifold(py::module_& module) {
  py::class_<OldManifold> manifold(module, "OldManifold",
                                   "Manifold of the previous step, in the frames of the bodies.");
  manifold.def_property_readonly(
      "kind",
      [](const OldManifold& self) {
        if (self.count() == 0) return "none";
        if (self.manifold.type == b2Manifold::e_circles) return "circles";
        return self.manifold.type == b2Manifold::e_faceA ? "face_a" : "face_b";
      },
      "`circles`, `face_a` or `face_b`, or `none` for a manifold without points.");
  manifold.def_property_readonly(
      "local_normal", [](const OldManifold& self) { return to_array(self.manifold.localNormal); },
      "Normal of the face, shape (2,).");
  manifold.def_property_readonly(
      "local_point", [](const OldManifold& self) { return to_array(self.manifold.localPoint); },
      "Center of a circle or of the face [m], shape (2,).");
  manifold.def_property_readonly(
      "points",
      [](const OldManifold& self) {
        b2Vec2 points[b2_maxManifoldPoints];
        for (std::size_t i = 0; i < self.count(); ++i) {
          points[i] = self.manifold.points[i].localPoint;
        }
        return to_array(points, self.count());
      },
      "Points in the frame of a body [m], shape (k, 2).");
  const auto bind_impulses = [&](const char* name, float b2ManifoldPoint::*impulse,
                                 const char* doc) {
    manifold.def_property_readonly(
        name,
        [=](const OldManifold& self) {
          float impulses[b2_maxManifoldPoints] = {};
          for (std::size_t i = 0; i < self.count(); ++i) {
            impulses[i] = self.manifold.points[i].*impulse;
          }
          return to_array(impulses, self.count());
        },
        doc);
  };
  bind_impulses("normal_impulses", &b2ManifoldPoint::normalImpulse,
                "Impulse along the normal at each point [N s], shape (k,).");
  bind_impulses("tangent_impulses", &b2ManifoldPoint::tangentImpulse,
                "Impulse along the surface at each point [N s], shape (k,).");
}

}  // namespace

void bind_contacts(py::module_& module, Classes& classes) {
  bind_recorded_contacts(module);
  bind_pre_solve_contact(module);
  bind_old_manifold(module);
  WorldClass& world = classes.world;
  world.def("_step_with_hook", &step_with_hook, py::arg("dt"), py::arg("velocity_iterations"),
            py::arg("position_iterations"), py::arg("hook"), py::arg("bodies"), py::arg("errors"));
  world.def_property(
      "record_contacts", [](World& self) { return self.contacts().is_recording(); },
      [](World& self, bool record) {
        self.check_changeable();
        self.contacts().recording = record;
      },
      "Whether steps record contact events; settable.");
  world.def(
      "take_contact_events",
      [](World& self) {
        self.check_changeable();
        return to_contacts<ContactEvent>(self.contacts().take_rows());
      },
      R"(
Returns the contact events since the last call, in order.

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def(
      "contacts",
      [](const World& self) {
        self.check_readable();
        return to_contacts<ContactInfo>(self.contacts().touching(self.engine()));
      },
      R"(
Returns the contacts of all fixtures that currently touch.

Raises:
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def(
      "record_contacts_of",
      [](World& self, Id body_id, std::uint8_t kinds) {
        self.change_body(body_id);
        self.contacts().record_body(body_id, kinds);
      },
      py::arg("body_id"), py::arg("kinds"), R"(
Records the contact events of one body, besides those of others.

Args:
    body_id: The body.
    kinds: 1 for `begin`, 2 for `end`, 4 for `post_solve`, or a sum of them; 0 for none.
)");
  world.def(
      "record_contacts_of_all",
      [](World& self, std::uint8_t kinds) {
        self.check_changeable();
        self.contacts().record_all(kinds);
      },
      py::arg("kinds"),
      "Records the contact events of some kinds of all bodies; see `record_contacts_of`.");
}

}  // namespace flatland
