#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "bindings/bindings.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

template <typename Scalar>
using Array = py::array_t<Scalar, py::array::c_style | py::array::forcecast>;

void check_shape(const py::array& array, py::ssize_t columns, const std::string& name) {
  if (array.ndim() == 2 && array.shape(1) == columns) return;
  throw py::value_error(name + " must have shape (n, " + std::to_string(columns) + "), got " +
                        std::string(py::str(array.attr("shape"))));
}

FixtureOptions options_of(double density, double friction, double restitution, bool is_sensor,
                          std::int64_t category_bits, std::int64_t mask_bits) {
  return {density,
          friction,
          restitution,
          is_sensor,
          checked_bits(category_bits, "category_bits"),
          checked_bits(mask_bits, "mask_bits")};
}

Id py_create_polygon(World& world, Id body, const Array<double>& points, double density,
                     double friction, double restitution, bool is_sensor,
                     std::int64_t category_bits, std::int64_t mask_bits) {
  check_shape(points, 2, "points");
  std::vector<b2Vec2> corners;
  const auto view = points.unchecked<2>();
  for (py::ssize_t i = 0; i < view.shape(0); ++i) {
    corners.push_back(checked_vector(view(i, 0), view(i, 1), "points[" + std::to_string(i) + "]"));
  }
  return create_polygon(
      world, body, corners,
      options_of(density, friction, restitution, is_sensor, category_bits, mask_bits));
}

std::size_t py_create_edges(World& world, Id body, const Array<float>& edges, double friction,
                            double restitution, std::int64_t category_bits,
                            std::int64_t mask_bits) {
  check_shape(edges, 4, "edges");
  const FixtureOptions options =
      options_of(0.0, friction, restitution, false, category_bits, mask_bits);
  // A copy, because other threads may write to the array while the GIL is released.
  const std::vector<float> rows(edges.data(), edges.data() + edges.size());
  // Safe without the GIL: the world is in exclusive use by this thread, and no Python object is
  // accessed.
  World::ExclusiveUse use(world, "is creating edges");
  return without_gil(
      use, [&] { return create_edges(world, body, rows.data(), rows.size() / 4, options); });
}

template <typename Scalar, std::size_t kWidth>
py::array_t<Scalar> to_array(const std::vector<std::array<Scalar, kWidth>>& rows) {
  py::array_t<Scalar> array(
      {static_cast<py::ssize_t>(rows.size()), static_cast<py::ssize_t>(kWidth)});
  if (!rows.empty()) {
    std::copy_n(rows.front().data(), rows.size() * kWidth, array.mutable_data());
  }
  return array;
}

using PyMaterial = std::tuple<float, float, float>;

Material checked_material(double reflectance, double transmission, double specular) {
  const auto checked_share = [](double share, const char* name) {
    if (share >= 0.0 && share <= 1.0) return static_cast<float>(share);
    throw std::invalid_argument(std::string(name) + " must be from 0 to 1, got " + to_text(share));
  };
  const Material material{checked_share(reflectance, "reflectance"),
                          checked_share(transmission, "transmission"),
                          checked_share(specular, "specular")};
  constexpr double kTolerance = 1e-9;
  if (transmission + specular > 1.0 + kTolerance) {
    throw std::invalid_argument("transmission + specular must be at most 1, got " +
                                to_text(transmission + specular));
  }
  return material;
}

const char* shape_name(const b2Fixture& fixture) {
  if (fixture.GetType() == b2Shape::e_circle) return "circle";
  return fixture.GetType() == b2Shape::e_polygon ? "polygon" : "edge";
}

}  // namespace

void bind_fixtures(WorldClass& world) {
  world.def("create_circle", [](World& self, Id body, double x, double y, double radius,
                                double density, double friction, double restitution, bool is_sensor,
                                std::int64_t category_bits, std::int64_t mask_bits) {
    return create_circle(
        self, body, x, y, radius,
        options_of(density, friction, restitution, is_sensor, category_bits, mask_bits));
  });
  world.def("create_polygon", &py_create_polygon);
  world.def("create_edges", &py_create_edges);
  world.def("edges", [](const World& self, Id body) { return to_array(edges_of(self, body)); });

  world.def("fixture_body",
            [](const World& self, Id id) { return id_of(self.read_fixture(id)->GetBody()); });
  world.def("fixture_shape",
            [](const World& self, Id id) { return shape_name(*self.read_fixture(id)); });
  world.def("fixture_vertices",
            [](const World& self, Id id) { return to_array(vertices_of(*self.read_fixture(id))); });
  world.def("fixture_center", [](const World& self, Id id) {
    const b2Vec2 center = center_of(*self.read_fixture(id));
    return std::make_tuple(static_cast<double>(center.x), static_cast<double>(center.y));
  });
  world.def("fixture_radius", [](const World& self, Id id) {
    // The radius of other shapes is the polygon radius of Box2D.
    const b2Fixture* fixture = self.read_fixture(id);
    return fixture->GetType() == b2Shape::e_circle ? fixture->GetShape()->m_radius : 0.0F;
  });
  world.def("fixture_density",
            [](const World& self, Id id) { return self.read_fixture(id)->GetDensity(); });
  world.def("fixture_friction",
            [](const World& self, Id id) { return self.read_fixture(id)->GetFriction(); });
  world.def("fixture_restitution",
            [](const World& self, Id id) { return self.read_fixture(id)->GetRestitution(); });
  world.def("fixture_is_sensor",
            [](const World& self, Id id) { return self.read_fixture(id)->IsSensor(); });
  world.def("set_fixture_is_sensor", &set_sensor);
  world.def("fixture_filter", [](const World& self, Id id) {
    const b2Filter& filter = self.read_fixture(id)->GetFilterData();
    return std::make_tuple(filter.categoryBits, filter.maskBits);
  });
  world.def("fixture_material", [](World& self, Id id) -> std::optional<PyMaterial> {
    const b2Fixture* fixture = self.read_fixture(id);
    const Materials& materials = self.rays().materials();
    const std::uint16_t number = materials.number_of(RayScene::Fixtures::slot_of(id_of(fixture)));
    if (number == 0) return std::nullopt;
    const Material& material = materials.at(number);
    return PyMaterial{material.reflectance, material.transmission, material.specular};
  });
  world.def("set_fixture_material",
            [](World& self, Id id, double reflectance, double transmission, double specular) {
              const Material material = checked_material(reflectance, transmission, specular);
              self.rays().set_material(self.change_fixture(id), material);
            });
  world.def("set_body_material",
            [](World& self, Id id, double reflectance, double transmission, double specular) {
              const Material material = checked_material(reflectance, transmission, specular);
              const b2Body* body = self.change_body(id);
              for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
                self.rays().set_material(f, material);
              }
            });
  world.def_property_readonly("has_materials", [](World& self) {
    self.check_readable();
    return !self.rays().materials().is_empty();
  });
  world.def("set_fixture_filter",
            [](World& self, Id id, std::int64_t category_bits, std::int64_t mask_bits) {
              set_filter(self, id, checked_bits(category_bits, "category_bits"),
                         checked_bits(mask_bits, "mask_bits"));
            });
}

}  // namespace flatland
