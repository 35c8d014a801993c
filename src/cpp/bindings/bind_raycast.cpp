#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <utility>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "bindings/values.h"
#include "rays/raycast.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

using Ends = Array<float>;
using Fractions = std::pair<py::array_t<float>, py::array_t<bool>>;

// Checks and converts the arguments, casts without the GIL if there are more rays than `max_short`,
// and returns (fractions, reflect).
template <typename Cast>
Fractions scan(World& world, const PyPose& pose, const Ends& ends, std::int64_t mask,
               std::int64_t reflect_mask, py::ssize_t max_short, Cast&& cast) {
  check_shape(ends, 2, "ends");
  ScanRequest request;
  request.pose = checked_pose(pose);
  request.ends = ends.data();
  request.count = static_cast<std::size_t>(ends.shape(0));
  request.mask = checked_bits(mask, "mask");
  request.reflect_mask = checked_bits(reflect_mask, "reflect_mask");
  // A known fan needs no check.
  FanCache& fans = world.rays().fans();
  std::shared_ptr<const BeamFan> fan = fans.find(request.ends, request.count);
  if (fan == nullptr) {
    check_all_finite(request.ends, 2 * request.count, 2, "ends");
    fan = fans.make(request.ends, request.count);
  }
  py::array_t<float> fractions(ends.shape(0));
  py::array_t<bool> reflect(ends.shape(0));
  const ScanResult result{fractions.mutable_data(), reflect.mutable_data()};
  // Safe without the GIL: `use` prevents changes of the world, the results are not shared yet, and
  // `ends` keeps its memory alive. If another thread writes to `ends`, the results are unspecified.
  World::SharedUse use(world);
  without_gil_if(ends.shape(0) > max_short, use, [&] { cast(*fan, request, result); });
  return {std::move(fractions), std::move(reflect)};
}

Fractions py_cast_rays(World& world, const PyPose& pose, const Ends& ends, std::int64_t mask,
                       std::int64_t reflect_mask) {
  constexpr py::ssize_t kShortScan = 2000;  // about 30 us
  return scan(world, pose, ends, mask, reflect_mask, kShortScan,
              [&](const BeamFan& fan, const ScanRequest& request, const ScanResult& result) {
                cast_rays(world.rays(), fan, request, result);
              });
}

Fractions py_cast_rays_reference(World& world, const PyPose& pose, const Ends& ends,
                                 std::int64_t mask, std::int64_t reflect_mask) {
  return scan(world, pose, ends, mask, reflect_mask, 0,
              [&](const BeamFan&, const ScanRequest& request, const ScanResult& result) {
                cast_rays_reference(world.engines(), request, result);
              });
}

std::optional<PyRayHit> py_ray_cast(const PyWorld& world, const PyPoint& start, const PyPoint& end,
                                    std::int64_t mask) {
  const b2Vec2 from = checked_point(start, "start");
  const b2Vec2 to = checked_point(end, "end");
  world.core->check_readable();
  const auto hit = ray_cast(world.core->engines(), from, to, checked_bits(mask, "mask"));
  if (!hit) return std::nullopt;
  return make_value<PyRayHit>(hit->fraction, to_python(hit->point), to_python(hit->normal),
                              FixtureHandle(world, hit->fixture), hit->category_bits);
}

}  // namespace

void bind_raycast(WorldClass& world) {
  world.def("ray_cast", &py_ray_cast, py::arg("start"), py::arg("end"), py::arg("mask") = 0xFFFF,
            R"(
Casts one ray with `b2World::RayCast`.

A ray that starts inside a circle or polygon does not hit that shape. Sensors are ignored.

Args:
    start: Start of the ray, world frame [m].
    end: End of the ray, world frame [m].
    mask: Categories that stop the ray.

Returns:
    The nearest hit; None if there is no hit or the ray has zero length.

Raises:
    ValueError: A number is not finite.
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def("cast_rays", &py_cast_rays, py::arg("pose"), py::arg("ends"), py::arg("mask"),
            py::arg("reflect_mask") = 0, R"(
Casts one ray from a rangefinder to each end point.

Releases the GIL for more than 2000 rays.

A ray is stopped by the nearest fixture with a category in `mask` that is not a sensor fixture. A
ray that starts inside a circle or polygon does not hit that shape. Edges are hit from both sides.

Args:
    pose: Pose (x, y, theta) of the rangefinder in the world frame [m, rad].
    ends: End points of the rays in the frame of the rangefinder [m], shape (n, 2), float32.
    mask: Categories that stop a ray.
    reflect_mask: Categories that reflect a ray; 0 if reflections are not needed.

Returns:
    Distance of each hit as a fraction of the length of the ray in [0, 1], NaN for a miss and for a
    ray of zero length, shape (n,); and for each ray whether a fixture with categories in both masks
    is at that distance, within 1e-4 m plus 1e-5 of the length of the ray, shape (n,).

Raises:
    ValueError: An array has a wrong shape or a number is not finite.
    StaleHandleError: The world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def("cast_rays_reference", &py_cast_rays_reference, py::arg("pose"), py::arg("ends"),
            py::arg("mask"), py::arg("reflect_mask") = 0,
            "Casts rays like `cast_rays`, with `b2World::RayCast`; slow, for comparison in tests.");
}

}  // namespace flatland
