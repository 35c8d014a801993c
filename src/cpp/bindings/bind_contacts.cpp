#include <box2d/b2_collision.h>
#include <box2d/b2_contact.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <unordered_set>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

py::array_t<double> to_array(const float (*rows)[2], std::size_t count) {
  py::array_t<double> array({static_cast<py::ssize_t>(count), py::ssize_t{2}});
  std::copy_n(&rows[0][0], 2 * count, array.mutable_data());
  return array;
}

py::array_t<double> to_array(const float* values, std::size_t count) {
  py::array_t<double> array(static_cast<py::ssize_t>(count));
  std::copy_n(values, count, array.mutable_data());
  return array;
}

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

py::object step_with_hook(World& world, double dt, int velocity_iterations, int position_iterations,
                          py::function callback, std::unordered_set<Id> bodies, py::list errors) {
  PythonHook hook(std::move(callback), std::move(bodies), std::move(errors));
  // Safe without the GIL: the world is in exclusive use by this thread, and the hook holds the GIL
  // while it accesses Python objects.
  World::ExclusiveUse use(world, World::kStepping);
  return to_python(without_gil(
      use, [&] { return world.step(dt, velocity_iterations, position_iterations, &hook); }));
}

// Converts rows to a tuple of arrays, one for each column; None if there are no rows.
py::object to_columns(const std::vector<ContactRow>& rows) {
  if (rows.empty()) return py::none();
  const auto n = static_cast<py::ssize_t>(rows.size());
  py::array_t<std::uint8_t> kinds(n);
  py::array_t<std::int64_t> ids({n, py::ssize_t{5}});
  py::array_t<std::int64_t> counts(n);
  py::array_t<double> points({n, py::ssize_t{2}, py::ssize_t{2}});
  py::array_t<double> normals({n, py::ssize_t{2}});
  py::array_t<double> impulses({n, py::ssize_t{2}, py::ssize_t{2}});
  py::array_t<bool> sensors(n);
  for (py::ssize_t i = 0; i < n; ++i) {
    const ContactRow& row = rows[static_cast<std::size_t>(i)];
    kinds.mutable_at(i) = static_cast<std::uint8_t>(row.kind);
    const std::uint64_t row_ids[] = {row.contact_id, row.fixture_a, row.fixture_b, row.body_a,
                                     row.body_b};
    std::transform(std::begin(row_ids), std::end(row_ids), ids.mutable_data(i, 0),
                   [](std::uint64_t id) { return static_cast<std::int64_t>(id); });
    counts.mutable_at(i) = row.point_count;
    std::copy_n(&row.points[0][0], 4, points.mutable_data(i, 0, 0));
    std::copy_n(row.normal, 2, normals.mutable_data(i, 0));
    std::copy_n(row.normal_impulses, 2, impulses.mutable_data(i, 0, 0));
    std::copy_n(row.tangent_impulses, 2, impulses.mutable_data(i, 1, 0));
    sensors.mutable_at(i) = row.is_sensor;
  }
  return py::make_tuple(kinds, ids, counts, points, normals, impulses, sensors);
}

void bind_pre_solve_contact(py::module_& module) {
  py::class_<PreSolveContact, std::shared_ptr<PreSolveContact>> contact(module, "PreSolveContact");
  contact.def_property_readonly("contact_id",
                                [](const PreSolveContact& self) { return self.row().contact_id; });
  contact.def_property_readonly("fixture_a",
                                [](const PreSolveContact& self) { return self.row().fixture_a; });
  contact.def_property_readonly("fixture_b",
                                [](const PreSolveContact& self) { return self.row().fixture_b; });
  contact.def_property_readonly("body_a",
                                [](const PreSolveContact& self) { return self.row().body_a; });
  contact.def_property_readonly("body_b",
                                [](const PreSolveContact& self) { return self.row().body_b; });
  contact.def_property_readonly("points", [](const PreSolveContact& self) {
    return to_array(self.row().points, self.row().point_count);
  });
  contact.def_property_readonly(
      "normal", [](const PreSolveContact& self) { return to_array(self.row().normal, 2); });
  contact.def_property(
      "enabled", [](const PreSolveContact& self) { return self.contact().IsEnabled(); },
      [](PreSolveContact& self, bool enabled) { self.contact().SetEnabled(enabled); });
  contact.def_property(
      "friction", [](const PreSolveContact& self) { return self.contact().GetFriction(); },
      [](PreSolveContact& self, double friction) {
        self.contact().SetFriction(checked_not_negative(friction, "friction"));
      });
  contact.def_property(
      "restitution", [](const PreSolveContact& self) { return self.contact().GetRestitution(); },
      [](PreSolveContact& self, double restitution) {
        self.contact().SetRestitution(checked_not_negative(restitution, "restitution"));
      });
  contact.def_property(
      "tangent_speed", [](const PreSolveContact& self) { return self.contact().GetTangentSpeed(); },
      [](PreSolveContact& self, double speed) {
        self.contact().SetTangentSpeed(checked_finite(speed, "tangent_speed"));
      });
}

void bind_old_manifold(py::module_& module) {
  py::class_<OldManifold> manifold(module, "OldManifold");
  manifold.def_property_readonly("kind", [](const OldManifold& self) {
    if (self.count() == 0) return "none";
    if (self.manifold.type == b2Manifold::e_circles) return "circles";
    return self.manifold.type == b2Manifold::e_faceA ? "face_a" : "face_b";
  });
  manifold.def_property_readonly("local_normal", [](const OldManifold& self) {
    const float normal[] = {self.manifold.localNormal.x, self.manifold.localNormal.y};
    return to_array(normal, 2);
  });
  manifold.def_property_readonly("local_point", [](const OldManifold& self) {
    const float point[] = {self.manifold.localPoint.x, self.manifold.localPoint.y};
    return to_array(point, 2);
  });
  manifold.def_property_readonly("points", [](const OldManifold& self) {
    float points[b2_maxManifoldPoints][2] = {};
    for (std::size_t i = 0; i < self.count(); ++i) {
      points[i][0] = self.manifold.points[i].localPoint.x;
      points[i][1] = self.manifold.points[i].localPoint.y;
    }
    return to_array(points, self.count());
  });
  manifold.def_property_readonly("normal_impulses", [](const OldManifold& self) {
    float impulses[b2_maxManifoldPoints] = {};
    for (std::size_t i = 0; i < self.count(); ++i) {
      impulses[i] = self.manifold.points[i].normalImpulse;
    }
    return to_array(impulses, self.count());
  });
  manifold.def_property_readonly("tangent_impulses", [](const OldManifold& self) {
    float impulses[b2_maxManifoldPoints] = {};
    for (std::size_t i = 0; i < self.count(); ++i) {
      impulses[i] = self.manifold.points[i].tangentImpulse;
    }
    return to_array(impulses, self.count());
  });
}

}  // namespace

void bind_contacts(py::module_& module, WorldClass& world) {
  bind_pre_solve_contact(module);
  bind_old_manifold(module);
  world.def("step_with_hook", &step_with_hook, py::arg("dt"), py::arg("velocity_iterations"),
            py::arg("position_iterations"), py::arg("hook"), py::arg("bodies"), py::arg("errors"));
  world.def_property(
      "record_contacts", [](World& self) { return self.contacts().is_recording(); },
      [](World& self, bool record) {
        self.check_changeable();
        self.contacts().recording = record;
      });
  world.def("take_contact_rows", [](World& self) {
    self.check_changeable();
    return to_columns(self.contacts().take_rows());
  });
  world.def("touching_rows", [](const World& self) {
    self.check_readable();
    return to_columns(self.contacts().touching(self.engine()));
  });
}

}  // namespace flatland
