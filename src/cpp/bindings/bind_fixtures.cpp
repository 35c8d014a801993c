#include <pybind11/stl.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/named.h"
#include "bindings/tuples.h"
#include "bindings/values.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

constexpr std::int64_t kAllBits = 0xFFFF;

using NamedBits = Named<std::int64_t>;

std::uint16_t bits_as(const char* name, NamedBits bits) {
  return checked_bits(bits.as(name), name);
}

FixtureOptions options_of(Named<double> density, Named<double> friction, Named<double> restitution,
                          Named<bool> is_sensor, NamedBits category_bits, NamedBits mask_bits) {
  return {density.as("density"),
          friction.as("friction"),
          restitution.as("restitution"),
          is_sensor.as("is_sensor"),
          bits_as("category_bits", category_bits),
          bits_as("mask_bits", mask_bits)};
}

FixtureHandle py_create_polygon(const BodyHandle& body, const Array<double>& points,
                                Named<double> density, Named<double> friction,
                                Named<double> restitution, Named<bool> is_sensor,
                                NamedBits category_bits, NamedBits mask_bits) {
  check_shape(points, 2, "points");
  std::vector<b2Vec2> corners;
  const auto view = points.unchecked<2>();
  for (py::ssize_t i = 0; i < view.shape(0); ++i) {
    corners.push_back(checked_vector(view(i, 0), view(i, 1), "points[" + std::to_string(i) + "]"));
  }
  const FixtureOptions options =
      options_of(density, friction, restitution, is_sensor, category_bits, mask_bits);
  return {body.world, create_polygon(body.core(), body.id, corners, options)};
}

std::size_t py_create_edges(const BodyHandle& body, const Array<float>& edges,
                            Named<double> friction, Named<double> restitution,
                            NamedBits category_bits, NamedBits mask_bits) {
  check_shape(edges, 4, "edges");
  const FixtureOptions options =
      options_of(Named(0.0), friction, restitution, Named(false), category_bits, mask_bits);
  // A copy, because other threads may write to the array while the GIL is released.
  const std::vector<float> rows(edges.data(), edges.data() + edges.size());
  // Safe without the GIL: the world is in exclusive use by this thread, and no Python object is
  // accessed.
  World& world = body.core();
  World::ExclusiveUse use(world, "is creating edges");
  return without_gil(
      use, [&] { return create_edges(world, body.id, rows.data(), rows.size() / 4, options); });
}

// Converts a sequence of a material.
Material checked_material(const Named<Numbers<3>>& material) {
  const Numbers<3> shares = material.as("material");
  const double reflectance = shares[0], transmission = shares[1], specular = shares[2];
  const auto checked_share = [](double share, const char* name) {
    if (share >= 0.0 && share <= 1.0) return static_cast<float>(share);
    throw std::invalid_argument(std::string(name) + " must be from 0 to 1, got " + to_text(share));
  };
  const Material checked{checked_share(reflectance, "reflectance"),
                         checked_share(transmission, "transmission"),
                         checked_share(specular, "specular")};
  constexpr double kTolerance = 1e-9;
  if (transmission + specular > 1.0 + kTolerance) {
    throw std::invalid_argument("transmission + specular must be at most 1, got " +
                                to_text(transmission + specular));
  }
  return checked;
}

std::optional<PyMaterial> material_of(const FixtureHandle& fixture) {
  World& world = fixture.core();
  world.read_fixture(fixture.id);
  const Materials& materials = world.rays().materials();
  const std::uint16_t number = materials.number_of(flatland::slot_of(fixture.id));
  if (number == 0) return std::nullopt;
  const Material& material = materials.at(number);
  return make_value<PyMaterial>(material.reflectance, material.transmission, material.specular);
}

const char* shape_name(const b2Fixture& fixture) {
  if (fixture.GetType() == b2Shape::e_circle) return "circle";
  return fixture.GetType() == b2Shape::e_polygon ? "polygon" : "edge";
}

// Sets bits that were checked.
void change_filter(const FixtureHandle& fixture, std::uint16_t b2Filter::*bits,
                   std::uint16_t value) {
  b2Filter filter = read(fixture).GetFilterData();
  filter.*bits = value;
  set_filter(fixture.core(), fixture.id, filter.categoryBits, filter.maskBits);
}

void bind_creation(py::class_<BodyHandle, Handle>& body) {
  body.def(
      "create_circle",
      [](const BodyHandle& self, const Named<PyPoint>& given_center, Named<double> radius,
         Named<double> density, Named<double> friction, Named<double> restitution,
         Named<bool> is_sensor, NamedBits category_bits, NamedBits mask_bits) {
        const PyPoint center = given_center.as("center");
        const FixtureOptions options =
            options_of(density, friction, restitution, is_sensor, category_bits, mask_bits);
        return FixtureHandle(self.world, create_circle(self.core(), self.id, center[0], center[1],
                                                       radius.as("radius"), options));
      },
      py::arg("center"), py::arg("radius"), py::kw_only(), py::arg("density"),
      py::arg("friction") = 0.0, py::arg("restitution") = 0.0, py::arg("is_sensor") = false,
      py::arg("category_bits") = kAllBits, py::arg("mask_bits") = kAllBits, R"(
Adds a circle to the body.

Args:
    center: Center in the body frame [m].
    radius: Radius, at least 0 [m]; a circle of radius 0 is a point without mass.
    density: Density, at least 0 [kg/m^2].
    friction: Friction coefficient, at least 0.
    restitution: Restitution coefficient, at least 0.
    is_sensor: Whether the fixture detects contacts without responding to them.
    category_bits: Categories of the fixture, 16 bits.
    mask_bits: Categories that the fixture collides with, 16 bits.

Returns:
    The new fixture.

Raises:
    ValueError: A number, or the resulting mass of the body, is out of range.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def("create_polygon", &py_create_polygon, py::arg("points"), py::kw_only(),
           py::arg("density"), py::arg("friction") = 0.0, py::arg("restitution") = 0.0,
           py::arg("is_sensor") = false, py::arg("category_bits") = kAllBits,
           py::arg("mask_bits") = kAllBits, R"(
Adds the convex hull of points to the body.

Args:
    points: 3 to 8 points in the body frame [m], shape (k, 2). Box2D drops each point that is less
        than 2.5 mm from an earlier one.
    density: Density, at least 0 [kg/m^2].
    friction: Friction coefficient, at least 0.
    restitution: Restitution coefficient, at least 0.
    is_sensor: Whether the fixture detects contacts without responding to them.
    category_bits: Categories of the fixture, 16 bits.
    mask_bits: Categories that the fixture collides with, 16 bits.

Returns:
    The new fixture.

Raises:
    ValueError: The array has a wrong shape, fewer than 3 points are distinct, the hull has no area,
        or a number or the resulting mass of the body is out of range.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def("create_edges", &py_create_edges, py::arg("edges"), py::kw_only(),
           py::arg("friction") = 0.0, py::arg("restitution") = 0.0,
           py::arg("category_bits") = kAllBits, py::arg("mask_bits") = kAllBits, R"(
Adds two-sided edges to the body, each as a fixture; releases the GIL.

Args:
    edges: Edges (x1, y1, x2, y2) in the body frame [m], shape (n, 4), float32. Edges shorter than
        1.2e-7 m have no direction and are skipped; nothing can collide with them.
    friction: Friction coefficient, at least 0.
    restitution: Restitution coefficient, at least 0.
    category_bits: Categories of the fixtures, 16 bits.
    mask_bits: Categories that the fixtures collide with, 16 bits.

Returns:
    The number of edges created.

Raises:
    ValueError: The array has a wrong shape or a number is out of range; no edge is created.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
  body.def(
      "edges", [](const BodyHandle& self) { return to_array(edges_of(self.core(), self.id)); },
      "Returns the edges (x1, y1, x2, y2) of the body in the body frame [m], shape (n, 4).");
  body.def(
      "set_material",
      [](const BodyHandle& self, const Named<Numbers<3>>& material) {
        const Material checked = checked_material(material);
        World& world = self.core();
        const b2Body* changed = world.change_body(self.id);
        world.structure_changed();
        for (const b2Fixture* f = changed->GetFixtureList(); f != nullptr; f = f->GetNext()) {
          world.set_material(f, checked);
        }
      },
      py::arg("material"), R"(
Gives all present fixtures of the body a material.

Args:
    material: A `Material`, or its three numbers.

Raises:
    ValueError: A number is not from 0 to 1, or `transmission` + `specular` is above 1.
    StaleHandleError: The body was destroyed.
    WorldLockedError: The world is stepping.
)");
}

void bind_shape(py::class_<FixtureHandle, Handle>& fixture) {
  fixture.def_property_readonly(
      "body",
      [](const FixtureHandle& self) { return BodyHandle(self.world, id_of(read(self).GetBody())); },
      "Body of the fixture.");
  def_reading(fixture, "shape", &shape_name, "Type of the shape, `circle`, `polygon` or `edge`.");
  fixture.def_property_readonly(
      "vertices",
      [](const FixtureHandle& self) {
        const std::vector<b2Vec2> vertices = vertices_of(read(self));
        return to_array(vertices.data(), vertices.size());
      },
      R"(
Vertices of the shape in the body frame [m], shape (n, 2).

The counter-clockwise corners of a polygon, the end points of an edge; empty for a circle.
)");
  fixture.def_property_readonly(
      "center", [](const FixtureHandle& self) { return to_python(center_of(read(self))); },
      "Center of a circle, centroid of a polygon or midpoint of an edge, body frame [m].");
  fixture.def_property_readonly(
      "radius",
      [](const FixtureHandle& self) {
        // The radius of other shapes is the polygon radius of Box2D.
        const b2Fixture& found = read(self);
        return found.GetType() == b2Shape::e_circle ? found.GetShape()->m_radius : 0.0F;
      },
      "Radius of a circle [m], 0 for other shapes.");
}

void bind_surface(py::class_<FixtureHandle, Handle>& fixture) {
  fixture.def_property(
      "density", [](const FixtureHandle& self) { return read(self).GetDensity(); },
      [](const FixtureHandle& self, Named<double> value) {
        set_density(self.core(), self.id, value.as("density"));
      },
      R"(
Density [kg/m^2]; settable, which also sets the mass of the body.

Raises:
    ValueError: The density is negative or not finite, or the mass of the body would be out of range.
)");
  fixture.def_property(
      "friction", [](const FixtureHandle& self) { return read(self).GetFriction(); },
      [](const FixtureHandle& self, Named<double> value) {
        set_friction(self.core(), self.id, value.as("friction"));
      },
      R"(
Friction coefficient; settable, also for present contacts.

Raises:
    ValueError: The coefficient is negative or not finite.
)");
  def_reading(fixture, "restitution", &b2Fixture::GetRestitution, "Restitution coefficient.");
  fixture.def_property(
      "is_sensor", [](const FixtureHandle& self) { return read(self).IsSensor(); },
      [](const FixtureHandle& self, Named<bool> value) {
        set_sensor(self.core(), self.id, value.as("is_sensor"));
      },
      "Whether the fixture is a sensor, which detects contacts but stops no ray; settable.");
  fixture.def_property(
      "category_bits",
      [](const FixtureHandle& self) { return read(self).GetFilterData().categoryBits; },
      [](const FixtureHandle& self, NamedBits bits) {
        change_filter(self, &b2Filter::categoryBits, bits_as("category_bits", bits));
      },
      "Categories of the fixture, 16 bits; settable.");
  fixture.def_property(
      "mask_bits", [](const FixtureHandle& self) { return read(self).GetFilterData().maskBits; },
      [](const FixtureHandle& self, NamedBits bits) {
        change_filter(self, &b2Filter::maskBits, bits_as("mask_bits", bits));
      },
      "Categories that the fixture collides with, 16 bits; settable.");
  fixture.def_property(
      "material", &material_of,
      [](const FixtureHandle& self, const Named<Numbers<3>>& material) {
        const Material checked = checked_material(material);
        World& world = self.core();
        world.set_material(world.change_fixture(self.id), checked);
        world.structure_changed();
      },
      R"(
Material of the surface, None for a plain one; can be set, not removed.

Raises:
    ValueError: A number is not from 0 to 1, or `transmission` + `specular` is above 1.
)");
}

}  // namespace

void bind_fixtures(Classes& classes) {
  bind_creation(classes.body);
  bind_shape(classes.fixture);
  bind_surface(classes.fixture);
  classes.world.def(
      "fixture", [](const PyWorld& self, Id fixture_id) { return FixtureHandle(self, fixture_id); },
      py::arg("fixture_id"),
      "Returns the handle of a fixture by its id, without checking that the fixture exists.");
  classes.world.def_property_readonly(
      "has_materials",
      [](World& self) {
        self.check_readable();
        return !self.rays().materials().is_empty();
      },
      "Whether a fixture has a material. `ray_cast` and `cast_rays` ignore materials.");
}

}  // namespace flatland
