#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "world/bodies.h"
#include "world/errors.h"
#include "world/overlap.h"

namespace py = pybind11;

namespace flatland {
namespace {

using Poses = Array<double>;

void check_poses(const Poses& poses) {
  check_shape(poses, 3, "poses");
  const double* values = poses.data();
  for (py::ssize_t i = 0; i < poses.size(); ++i) {
    if (std::abs(values[i]) <= kMaxMagnitude) continue;
    checked_finite(values[i],
                   "poses[" + std::to_string(i / 3) + ", " + std::to_string(i % 3) + "]");
  }
}

Probe complete(Probe probe, const World& world, const std::vector<Id>& ignored, double least_gap) {
  probe.ignored = sorted_bodies(world, ignored);
  probe.least_gap = checked_finite(least_gap, "least_gap");
  return probe;
}

// The bodies of a probe are among the ignored bodies.
Probe model_probe(const World& world, const Bodies& bodies, const Bodies& ignored,
                  double least_gap) {
  const std::vector<Id> ids = ids_in(world, bodies);
  Probe probe = probe_of_bodies(world, ids);
  std::vector<Id> all_ignored = ids_in(world, ignored);
  all_ignored.insert(all_ignored.end(), ids.begin(), ids.end());
  return complete(std::move(probe), world, all_ignored, least_gap);
}

py::array_t<bool> free_at(World& world, const Probe& probe, const Poses& poses) {
  check_poses(poses);
  py::array_t<bool> is_free(poses.shape(0));
  const double* in = poses.data();
  bool* out = is_free.mutable_data();
  const auto count = static_cast<std::size_t>(poses.shape(0));
  // Safe without the GIL: `use` prevents changes of the world, so the bodies of the probe remain
  // valid; the result is not shared yet, and `poses` keeps its memory alive.
  World::SharedUse use(world);
  without_gil(use, [&] { find_free_poses(world.engines(), probe, in, count, out); });
  return is_free;
}

std::vector<BodyHandle> py_overlapping_bodies(const PyWorld& world, const Bodies& bodies,
                                              const PyPose& pose, const Bodies& ignored,
                                              double least_gap) {
  const World& core = *world.core;
  const b2Transform transform = checked_pose(pose);
  core.check_readable();
  const Probe probe = model_probe(core, bodies, ignored, least_gap);
  std::vector<BodyHandle> found;
  for (const Id id : overlapping_bodies(core.engines(), probe, transform)) {
    found.emplace_back(world, id);
  }
  return found;
}

py::array_t<bool> py_free_poses(World& world, const Bodies& bodies, const Poses& poses,
                                const Bodies& ignored, double least_gap) {
  world.check_readable();
  return free_at(world, model_probe(world, bodies, ignored, least_gap), poses);
}

py::array_t<bool> py_free_discs(World& world, const Poses& poses, double radius, std::int64_t bits,
                                const Bodies& ignored, const std::optional<Bodies>& only,
                                double least_gap) {
  world.check_readable();
  Probe disc = probe_of_disc(checked_not_negative(radius, "radius"), checked_bits(bits, "bits"));
  disc = complete(std::move(disc), world, ids_in(world, ignored), least_gap);
  if (only) disc.only = sorted_bodies(world, ids_in(world, *only));
  return free_at(world, disc, poses);
}

}  // namespace

void bind_overlap(WorldClass& world) {
  world.def("overlapping_bodies", &py_overlapping_bodies, py::arg("bodies"), py::arg("pose"),
            py::kw_only(), py::arg("ignored") = py::tuple(), py::arg("least_gap") = 0.0, R"(
Returns the other bodies that a rigid group of bodies would overlap at a pose.

Only pairs of fixtures that can collide are considered: neither is a sensor, their category and mask
bits match, at least one body is dynamic, and no joint prevents the collision. The distance of two
shapes excludes the polygon radius of Box2D. Edges have no interior: a closed loop of edges overlaps
only shapes that intersect one of the edges.

Args:
    bodies: Bodies of the group, at least one.
    pose: Pose (x, y, theta) of the first body in the world frame [m, rad].
    ignored: Bodies that may be overlapped.
    least_gap: Distance below which two fixtures overlap [m]; if negative, the penetration depth
        that is tolerated.

Returns:
    The overlapped bodies, each once, in order of their ids.

Raises:
    ValueError: There are no bodies, or a number is not finite.
    StaleHandleError: A body was destroyed, or the world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def("free_poses", &py_free_poses, py::arg("bodies"), py::arg("poses"), py::kw_only(),
            py::arg("ignored") = py::tuple(), py::arg("least_gap") = 0.0, R"(
Returns the poses at which a rigid group of bodies would not overlap other bodies.

See `overlapping_bodies`. Releases the GIL.

Args:
    bodies: Bodies of the group, at least one.
    poses: Poses (x, y, theta) of the first body in the world frame [m, rad], shape (n, 3).
    ignored: Bodies that may be overlapped.
    least_gap: Distance below which two fixtures overlap [m].

Returns:
    Whether each pose is free, shape (n,).

Raises:
    ValueError: There are no bodies, an array has a wrong shape, or a number is not finite.
    StaleHandleError: A body was destroyed, or the world is closed.
    WorldLockedError: The world is stepping.
)");
  world.def("free_discs", &py_free_discs, py::arg("poses"), py::arg("radius"), py::arg("bits"),
            py::kw_only(), py::arg("ignored") = py::tuple(), py::arg("only") = py::none(),
            py::arg("least_gap") = 0.0, R"(
Returns the poses at which a disc would not overlap any body; see `free_poses`.

Args:
    poses: Poses (x, y, theta) of the center in the world frame [m, rad], shape (n, 3).
    radius: Radius of the disc, at least 0 [m].
    bits: Category and mask bits of the disc.
    ignored: Bodies that may be overlapped.
    only: Bodies that are considered; None for all bodies.
    least_gap: Distance below which a fixture overlaps the disc [m].

Returns:
    Whether each pose is free, shape (n,).

Raises:
    ValueError: An array has a wrong shape or a number is out of range.
    StaleHandleError: A body was destroyed, or the world is closed.
    WorldLockedError: The world is stepping.
)");
}

}  // namespace flatland
