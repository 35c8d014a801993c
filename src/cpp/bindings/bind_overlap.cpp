#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "world/errors.h"
#include "world/overlap.h"

namespace py = pybind11;

namespace flatland {
namespace {

using Poses = py::array_t<double, py::array::c_style | py::array::forcecast>;
using PyPose = std::tuple<double, double, double>;
using Ids = std::vector<Id>;

void check_poses(const Poses& poses) {
  if (poses.ndim() != 2 || poses.shape(1) != 3) {
    throw py::value_error("poses must have shape (n, 3), got " +
                          std::string(py::str(poses.attr("shape"))));
  }
  const double* values = poses.data();
  for (py::ssize_t i = 0; i < poses.size(); ++i) {
    if (std::abs(values[i]) <= kMaxMagnitude) continue;
    checked_finite(values[i],
                   "poses[" + std::to_string(i / 3) + ", " + std::to_string(i % 3) + "]");
  }
}

Probe complete(Probe probe, const World& world, const Ids& ignored, const std::optional<Ids>& only,
               double least_gap) {
  probe.ignored = sorted_bodies(world, ignored);
  if (only) probe.only = sorted_bodies(world, *only);
  probe.least_gap = checked_finite(least_gap, "least_gap");
  return probe;
}

// The bodies of a probe are among the ignored bodies.
Probe model_probe(const World& world, const Ids& bodies, Ids ignored, double least_gap) {
  Probe probe = probe_of_bodies(world, bodies);
  ignored.insert(ignored.end(), bodies.begin(), bodies.end());
  return complete(std::move(probe), world, ignored, std::nullopt, least_gap);
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
  without_gil(use, [&] { find_free_poses(world.engine(), probe, in, count, out); });
  return is_free;
}

Ids py_overlapping_bodies(const World& world, const Ids& bodies, const PyPose& pose,
                          const Ids& ignored, double least_gap) {
  const auto& [x, y, theta] = pose;
  b2Transform transform;
  transform.p = checked_vector(x, y, "pose");
  transform.q.Set(checked_finite(theta, "pose angle"));
  world.check_readable();
  const Probe probe = model_probe(world, bodies, ignored, least_gap);
  return overlapping_bodies(world.engine(), probe, transform);
}

py::array_t<bool> py_free_poses(World& world, const Ids& bodies, const Poses& poses,
                                const Ids& ignored, double least_gap) {
  world.check_readable();
  return free_at(world, model_probe(world, bodies, ignored, least_gap), poses);
}

py::array_t<bool> py_free_discs(World& world, const Poses& poses, double radius, std::int64_t bits,
                                const Ids& ignored, const std::optional<Ids>& only,
                                double least_gap) {
  world.check_readable();
  Probe disc = probe_of_disc(checked_not_negative(radius, "radius"), checked_bits(bits, "bits"));
  return free_at(world, complete(std::move(disc), world, ignored, only, least_gap), poses);
}

}  // namespace

void bind_overlap(WorldClass& world) {
  world.def("overlapping_bodies", &py_overlapping_bodies);
  world.def("free_poses", &py_free_poses);
  world.def("free_discs", &py_free_discs);
}

}  // namespace flatland
