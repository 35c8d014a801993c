#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_set>
#include <utility>
#include <variant>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "bindings/values.h"
#include "rays/range_finder.h"
#include "rays/scan_batch.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

using Ends = Array<float>;
using Ranges = py::array_t<float, py::array::c_style>;
// A range finder, body, stream and number of the update of the noise.
using PyJob = std::tuple<std::shared_ptr<RangeFinder>, BodyHandle, std::uint64_t, std::uint64_t>;

// Scans of more beams release the GIL; they take more than about 0.03 ms.
constexpr std::size_t kShortScans = 2000;

std::shared_ptr<BeamFan> make_fan(const Ends& ends) {
  check_shape(ends, 2, "ends");
  check_all_finite(ends.data(), static_cast<std::size_t>(ends.size()), 2, "ends");
  return std::make_shared<BeamFan>(ends.data(), static_cast<std::size_t>(ends.shape(0)));
}

RangeFinder make_finder(const std::variant<std::shared_ptr<BeamFan>, Ends>& beams, double length,
                        const PyPose& origin, std::int64_t mask, std::int64_t reflect_mask,
                        double range_min, double no_hit, std::optional<RangeNoise> noise,
                        const std::string& out_of_range, bool uses_materials, bool is_cone) {
  const auto* shared = std::get_if<std::shared_ptr<BeamFan>>(&beams);
  const auto fan = shared == nullptr ? make_fan(std::get<Ends>(beams)) : *shared;
  if (fan == nullptr) throw py::type_error("a range finder requires beams, got None");
  checked_vector(origin[0], origin[1], "origin");
  checked_finite(origin[2], "origin angle");
  using OutOfRange = RangeLimits::OutOfRange;
  const RangeFinder::Parameters parameters{
      origin,
      checked_not_negative(length, "length"),
      checked_bits(mask, "mask"),
      checked_bits(reflect_mask, "reflect_mask"),
      {checked_not_negative(range_min, "range_min"),
       std::isfinite(no_hit) ? checked_finite(no_hit, "no_hit") : static_cast<float>(no_hit),
       checked_not_negative(length, "length"),
       chosen<OutOfRange>(out_of_range, "out_of_range",
                          {{"keep", OutOfRange::kKeep},
                           {"clamp", OutOfRange::kClamp},
                           {"drop", OutOfRange::kDrop}})},
      std::move(noise),
      uses_materials,
      is_cone};
  return RangeFinder(fan, parameters);
}

// Shared uses of several worlds that end together.
class SharedUses {
 public:
  // Adds a use of a world that is not in use yet.
  void add(World& world) {
    if (worlds_.insert(&world).second) uses_.push_back(std::make_unique<World::SharedUse>(world));
  }
  void end() {
    for (const auto& use : uses_) use->end();
  }

 private:
  std::unordered_set<const World*> worlds_;
  std::vector<std::unique_ptr<World::SharedUse>> uses_;
};

// The scans of one call, with the Python objects of their results.
class PyScans {
 public:
  // Readings are written to new arrays.
  void add(const RangeFinder& finder, const BodyHandle& body, const NoiseKey& key) {
    add(finder, body, key, Ranges(static_cast<py::ssize_t>(finder.readings())));
  }

  void add(const RangeFinder& finder, const BodyHandle& body, const NoiseKey& key, Ranges ranges) {
    World& world = body.core();
    std::optional<Ranges> intensities;
    if (finder.has_intensities(world.rays())) {
      intensities.emplace(static_cast<py::ssize_t>(finder.beams()));
    }
    scans_.push_back(
        {&world, &finder, body.id, key, std::move(ranges), std::move(intensities), {}});
    beams_ += finder.beams();
  }

  // Performs the scans. Safe without the GIL: the worlds are in use,
  // and the caller keeps them and the range finders alive. If another thread accesses the arrays,
  // their contents are unspecified.
  std::vector<PyScan> run(ThreadPool& pool, std::size_t num_threads) {
    // No Python object is created while the worlds are in use. That may start the garbage
    // collector, which runs Python code; another thread may then acquire the GIL and wait for the
    // end of the use.
    SharedUses uses;
    std::vector<ScanJob> jobs;
    for (Scan& scan : scans_) {
      uses.add(*scan.world);
      scan.pose = scan.finder->pose_of(pose_of(*scan.world, scan.body));
      const Readings out{scan.ranges.mutable_data(),
                         scan.intensities ? scan.intensities->mutable_data() : nullptr};
      jobs.push_back({&scan.world->rays(), scan.finder, checked_pose(scan.pose), scan.key, out});
    }
    without_gil_if(beams_ > kShortScans, uses, [&] { scan_all(jobs, pool, num_threads); });
    std::vector<PyScan> results;
    for (Scan& scan : scans_) {
      py::object intensities = py::none();
      if (scan.intensities) intensities = std::move(*scan.intensities);
      results.push_back(
          make_value<PyScan>(to_python(scan.pose), std::move(scan.ranges), std::move(intensities)));
    }
    return results;
  }

 private:
  struct Scan {
    World* world;
    const RangeFinder* finder;
    Id body;
    NoiseKey key;
    Ranges ranges;
    std::optional<Ranges> intensities;
    Triple pose;  // of the sensor
  };

  std::vector<Scan> scans_;
  std::size_t beams_ = 0;
};

PyScan py_scan(const RangeFinder& finder, const BodyHandle& body, std::uint64_t stream,
               std::uint64_t update) {
  PyScans scans;
  scans.add(finder, body, {stream, update});
  return scans.run(body.core().threads(), 1).front();
}

PyLabelledScan py_scan_labels(const RangeFinder& finder, const BodyHandle& body,
                              std::uint64_t stream, std::uint64_t update) {
  World& world = body.core();
  const Triple pose = finder.pose_of(pose_of(world, body.id));
  Ranges ranges(static_cast<py::ssize_t>(finder.readings()));
  py::array_t<std::uint32_t> labels(static_cast<py::ssize_t>(finder.beams()));
  HitTable hits{labels.mutable_data(), {}};
  const Readings out{ranges.mutable_data(), nullptr, &hits};
  const ScanJob job{&world.rays(), &finder, checked_pose(pose), {stream, update}, out};
  {
    SharedUses uses;
    uses.add(world);
    without_gil_if(finder.beams() > kShortScans, uses,
                   [&] { scan_all({job}, world.threads(), 1); });
  }
  std::vector<std::tuple<Id, std::uint16_t>> entries;
  for (const HitTable::Entry& entry : hits.entries) {
    entries.emplace_back(entry.body, entry.category_bits);
  }
  return make_value<PyLabelledScan>(to_python(pose), std::move(ranges), std::move(labels),
                                    std::move(entries));
}

// A view of row `i` of the output array.
Ranges row_of(const Ranges& out, py::ssize_t i) {
  return Ranges({out.shape(1)}, {out.strides(1)}, out.data(i, 0), out);
}

Ranges checked_output(const py::object& out, const std::vector<PyJob>& jobs) {
  if (!py::isinstance<Ranges>(out)) {
    throw py::type_error("out must be a C-contiguous array of type float32");
  }
  auto array = py::cast<Ranges>(out);
  const std::size_t beams = jobs.empty() ? 0 : std::get<0>(jobs.front())->readings();
  for (const PyJob& job : jobs) {
    const std::size_t readings = std::get<0>(job)->readings();
    if (readings != beams) {
      throw py::value_error("out requires scans with the same number of beams, got " +
                            std::to_string(beams) + " and " + std::to_string(readings));
    }
  }
  const bool fits = array.ndim() == 2 && array.shape(0) == static_cast<py::ssize_t>(jobs.size()) &&
                    (jobs.empty() || array.shape(1) == static_cast<py::ssize_t>(beams));
  if (!fits) {
    throw py::value_error("out must have shape (" + std::to_string(jobs.size()) + ", " +
                          std::to_string(beams) + "), got " +
                          std::string(py::str(array.attr("shape"))));
  }
  if (!array.writeable()) throw py::value_error("out must be writeable");
  return array;
}

std::vector<PyScan> py_scan_all(const std::vector<PyJob>& requests, const py::object& out,
                                std::int64_t num_threads) {
  if (num_threads < 0) {
    throw py::value_error("num_threads must not be negative, got " + std::to_string(num_threads));
  }
  for (const PyJob& request : requests) {
    if (std::get<0>(request) == nullptr) {
      throw py::type_error("a scan requires a range finder, got None");
    }
  }
  std::optional<Ranges> array;
  if (!out.is_none()) array = checked_output(out, requests);
  if (requests.empty()) return {};
  PyScans scans;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const auto& [finder, body, stream, update] = requests[i];
    if (array) {
      scans.add(*finder, body, {stream, update}, row_of(*array, static_cast<py::ssize_t>(i)));
    } else {
      scans.add(*finder, body, {stream, update});
    }
  }
  ThreadPool& threads = std::get<1>(requests.front()).core().threads();
  return scans.run(threads, static_cast<std::size_t>(num_threads));
}

void bind_noise(py::module_& module) {
  py::class_<RangeNoise>(module, "RangeNoise", "A noise model of a range finder; immutable.")
      .def_static("additive", &RangeNoise::additive, py::arg("deviation"), R"(
Returns normally distributed noise.

Args:
    deviation: Standard deviation [m].
)")
      .def_static("proportional", &RangeNoise::proportional, py::arg("deviation"), R"(
Returns normally distributed noise that is proportional to the range.

Args:
    deviation: Standard deviation as a fraction of the range.
)")
      .def_static(
          "beam",
          [](double z_hit, double z_short, double z_max, double z_rand, double sigma_hit,
             double lambda_short, double max_range) {
            return RangeNoise::beam(
                {z_hit, z_short, z_max, z_rand, sigma_hit, lambda_short, max_range});
          },
          py::kw_only(), py::arg("z_hit"), py::arg("z_short"), py::arg("z_max"), py::arg("z_rand"),
          py::arg("sigma_hit"), py::arg("lambda_short"), py::arg("max_range"),
          "Returns the beam model of Thrun, Burgard and Fox, with the names of its parameters.");
  py::class_<BeamFan, std::shared_ptr<BeamFan>>(
      module, "BeamFan", "The beams of range finders, sorted by direction; immutable.")
      .def(py::init(&make_fan), py::arg("ends"), R"(
Prepares beams for scans; several range finders may share them.

Args:
    ends: End points of the beams in the frame of the sensor [m], shape (n, 2), float32.

Raises:
    ValueError: The array has a wrong shape or a number is not finite.
)")
      .def_property_readonly("beams", &BeamFan::size, "Number of beams.");
}

}  // namespace

void bind_range_finder(py::module_& module) {
  bind_noise(module);
  py::class_<RangeFinder, std::shared_ptr<RangeFinder>> finder(module, "RangeFinder", R"(
A fan of beams with their filter and their noise model; immutable, independent of a world.

Readings are a function of the poses of all fixtures, of the stream of random numbers and of the
number of the update. They depend neither on other scans nor on the number of threads.
)");
  finder.def(py::init(&make_finder), py::arg("beams"), py::arg("length"), py::kw_only(),
             py::arg("origin"), py::arg("mask"), py::arg("reflect_mask") = 0,
             py::arg("range_min") = 0.0, py::arg("no_hit") = std::nan(""),
             py::arg("noise") = py::none(), py::arg("out_of_range") = "keep",
             py::arg("uses_materials") = true, py::arg("is_cone") = false, R"(
Creates a range finder.

Args:
    beams: End points of the beams in the frame of the sensor [m], shape (n, 2), or a `BeamFan` made
        from them.
    length: Length of the beams [m].
    origin: Pose (x, y, theta) of the sensor in the frame of its body [m, rad].
    mask: Categories that stop a beam; see `PhysicsWorld.cast_rays`.
    reflect_mask: Categories that reflect a beam; 0 if intensities are not needed.
    range_min: Shortest range that is reported [m]; a shorter one is -inf. With 0, noise can make
        ranges negative.
    no_hit: Range that is reported for a beam without a hit [m].
    noise: Noise model; None for exact ranges.
    out_of_range: What becomes of a hit whose range is below `range_min` or above `length` because
        of normal noise: `keep`, `clamp` to these limits, or `drop`, which reports -inf and `no_hit`
        instead.
    uses_materials: Whether materials let beams pass and reflect them; otherwise each fixture stops
        all beams.
    is_cone: Whether there is a single reading, that of the nearest hit of all beams.

Raises:
    ValueError: An array has a wrong shape, a number is not finite or out of range, or `length` is
        above the maximum range of the noise model.
)");
  finder.def_property_readonly("beams", &RangeFinder::beams, "Number of beams.");
  finder.def("scan", &py_scan, py::arg("body"), py::arg("stream"), py::arg("update"), R"(
Performs a scan. Releases the GIL for more than 2000 beams.

Args:
    body: Body on which the sensor is mounted.
    stream: Key of the stream of random numbers, a 64-bit integer.
    update: Number of the update in the stream, from 0 to 2**64 - 1.

Raises:
    ValueError: The pose of the body is not finite.
    StaleHandleError: The body was destroyed, or the world is closed.
    WorldLockedError: The world is stepping.
)");
  finder.def("scan_labels", &py_scan_labels, py::arg("body"), py::arg("stream"), py::arg("update"),
             R"(
Performs the same scan as `scan`, and finds out which bodies the beams hit.

Arguments and errors are those of `scan`.
)");
  finder.def(
      "__deepcopy__", [](const py::object& self, const py::dict&) { return self; }, py::arg("memo"),
      "Returns this object, which is immutable.");
  module.def("scan_all", &py_scan_all, py::arg("requests"), py::arg("out") = py::none(),
             py::arg("num_threads") = 0, R"(
Performs many scans, in one or several worlds, in one call on several threads.

The result equals that of `RangeFinder.scan` for each request, for any number of threads. Releases
the GIL for more than 2000 beams. If an error is raised, no scan was performed.

Args:
    requests: The scans, as `ScanRequest`.
    out: Array for the ranges, shape (len(requests), n), float32, C-contiguous; the ranges of the
        returned scans are views of its rows. None for new arrays.
    num_threads: Maximum number of threads; 0 for all processors that are available.

Raises:
    TypeError: `out` is not a C-contiguous array of type float32.
    ValueError: `out` has a wrong shape, `num_threads` is negative, or the pose of a body is not
        finite.
    StaleHandleError: A body was destroyed, or a world is closed.
    WorldLockedError: A world is stepping.
)");
}

}  // namespace flatland
