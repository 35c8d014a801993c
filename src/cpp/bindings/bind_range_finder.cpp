#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_set>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "rays/range_finder.h"
#include "rays/scan_batch.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

using Ends = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Ranges = py::array_t<float, py::array::c_style>;
using PyPose = std::tuple<double, double, double>;
using Finder = std::shared_ptr<const RangeFinder>;
// World, range finder, body, stream and number of the update of the noise.
using PyJob = std::tuple<std::shared_ptr<World>, std::shared_ptr<RangeFinder>, Id, std::uint64_t,
                         std::uint64_t>;

// Scans of more beams release the GIL; they take more than about 0.03 ms.
constexpr std::size_t kShortScans = 2000;

std::shared_ptr<BeamFan> make_fan(const Ends& ends) {
  if (ends.ndim() != 2 || ends.shape(1) != 2) {
    throw py::value_error("ends must have shape (n, 2), got " +
                          std::string(py::str(ends.attr("shape"))));
  }
  check_all_finite(ends.data(), static_cast<std::size_t>(ends.size()), 2, "ends");
  return std::make_shared<BeamFan>(ends.data(), static_cast<std::size_t>(ends.shape(0)));
}

RangeFinder make_finder(const std::shared_ptr<BeamFan>& fan, const PyPose& origin, double length,
                        std::int64_t mask, std::int64_t reflect_mask, double range_min,
                        double no_hit, std::optional<RangeNoise> noise, bool uses_materials,
                        bool is_cone) {
  const auto& [x, y, theta] = origin;
  checked_vector(x, y, "origin");
  checked_finite(theta, "origin angle");
  const RangeFinder::Parameters parameters{
      {x, y, theta},
      checked_not_negative(length, "length"),
      checked_bits(mask, "mask"),
      checked_bits(reflect_mask, "reflect_mask"),
      {checked_not_negative(range_min, "range_min"),
       std::isfinite(no_hit) ? checked_finite(no_hit, "no_hit") : static_cast<float>(no_hit)},
      std::move(noise),
      uses_materials,
      is_cone};
  return RangeFinder(fan, parameters);
}

b2Transform to_transform(const Triple& pose) {
  b2Transform transform;
  transform.p = checked_vector(pose[0], pose[1], "pose");
  transform.q.Set(checked_finite(pose[2], "pose angle"));
  return transform;
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
  void add(World& world, const RangeFinder& finder, Id body, const NoiseKey& key) {
    add(world, finder, body, key, Ranges(static_cast<py::ssize_t>(finder.readings())));
  }

  void add(World& world, const RangeFinder& finder, Id body, const NoiseKey& key, Ranges ranges) {
    std::optional<Ranges> intensities;
    if (finder.has_intensities(world.rays())) {
      intensities.emplace(static_cast<py::ssize_t>(finder.beams()));
    }
    scans_.push_back({&world, &finder, body, key, std::move(ranges), std::move(intensities), {}});
    beams_ += finder.beams();
  }

  // Returns (pose, ranges, intensities) of each scan. Safe without the GIL: the worlds are in use,
  // and the caller keeps them and the range finders alive. If another thread accesses the arrays,
  // their contents are unspecified.
  std::vector<py::tuple> run(ThreadPool& pool, std::size_t num_threads) {
    // No Python object is created while the worlds are in use. That may start the garbage
    // collector, which runs Python code; another thread may then acquire the GIL and wait for the
    // end of the use.
    SharedUses uses;
    std::vector<ScanJob> jobs;
    for (PyScan& scan : scans_) {
      uses.add(*scan.world);
      scan.pose = scan.finder->pose_of(pose_of(*scan.world, scan.body));
      const Readings out{scan.ranges.mutable_data(),
                         scan.intensities ? scan.intensities->mutable_data() : nullptr};
      jobs.push_back({&scan.world->rays(), scan.finder, to_transform(scan.pose), scan.key, out});
    }
    without_gil_if(beams_ > kShortScans, uses, [&] { scan_all(jobs, pool, num_threads); });
    std::vector<py::tuple> results;
    for (PyScan& scan : scans_) {
      const auto& [x, y, theta] = scan.pose;
      py::object intensities = py::none();
      if (scan.intensities) intensities = std::move(*scan.intensities);
      results.push_back(py::make_tuple(py::make_tuple(x, y, theta), std::move(scan.ranges),
                                       std::move(intensities)));
    }
    return results;
  }

 private:
  struct PyScan {
    World* world;
    const RangeFinder* finder;
    Id body;
    NoiseKey key;
    Ranges ranges;
    std::optional<Ranges> intensities;
    Triple pose;  // of the sensor
  };

  std::vector<PyScan> scans_;
  std::size_t beams_ = 0;
};

py::tuple py_scan(const RangeFinder& finder, World& world, Id body, std::uint64_t stream,
                  std::uint64_t update) {
  PyScans scans;
  scans.add(world, finder, body, {stream, update});
  return scans.run(world.threads(), 1).front();
}

// A scan with what the beams hit: (pose, ranges, labels, [(body, category bits)]).
py::tuple py_scan_labels(const RangeFinder& finder, World& world, Id body, std::uint64_t stream,
                         std::uint64_t update) {
  const Triple pose = finder.pose_of(pose_of(world, body));
  Ranges ranges(static_cast<py::ssize_t>(finder.readings()));
  py::array_t<std::uint32_t> labels(static_cast<py::ssize_t>(finder.beams()));
  HitTable hits{labels.mutable_data(), {}};
  const Readings out{ranges.mutable_data(), nullptr, &hits};
  const ScanJob job{&world.rays(), &finder, to_transform(pose), {stream, update}, out};
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
  return py::make_tuple(std::make_tuple(pose[0], pose[1], pose[2]), std::move(ranges),
                        std::move(labels), std::move(entries));
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
  const std::size_t beams = jobs.empty() ? 0 : std::get<1>(jobs.front())->readings();
  for (const PyJob& job : jobs) {
    if (std::get<1>(job)->readings() != beams) {
      throw py::value_error("out requires scans with the same number of beams, got " +
                            std::to_string(beams) + " and " +
                            std::to_string(std::get<1>(job)->readings()));
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

std::vector<py::tuple> py_scan_all(const std::vector<PyJob>& jobs, const py::object& out,
                                   std::int64_t num_threads) {
  if (num_threads < 0) {
    throw py::value_error("num_threads must not be negative, got " + std::to_string(num_threads));
  }
  std::optional<Ranges> array;
  if (!out.is_none()) array = checked_output(out, jobs);
  if (jobs.empty()) return {};
  PyScans scans;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const auto& [world, finder, body, stream, update] = jobs[i];
    if (world == nullptr || finder == nullptr) {
      throw py::type_error("a scan requires a world and a range finder, got None");
    }
    if (array) {
      scans.add(*world, *finder, body, {stream, update},
                row_of(*array, static_cast<py::ssize_t>(i)));
    } else {
      scans.add(*world, *finder, body, {stream, update});
    }
  }
  return scans.run(std::get<0>(jobs.front())->threads(), static_cast<std::size_t>(num_threads));
}

}  // namespace

void bind_range_finder(py::module_& module) {
  py::class_<RangeNoise>(module, "RangeNoise", "A noise model of a range finder; immutable.")
      .def_static("additive", &RangeNoise::additive, py::arg("deviation"))
      .def_static("proportional", &RangeNoise::proportional, py::arg("deviation"))
      .def_static(
          "beam",
          [](double z_hit, double z_short, double z_max, double z_rand, double sigma_hit,
             double lambda_short, double max_range) {
            return RangeNoise::beam(
                {z_hit, z_short, z_max, z_rand, sigma_hit, lambda_short, max_range});
          },
          py::kw_only(), py::arg("z_hit"), py::arg("z_short"), py::arg("z_max"), py::arg("z_rand"),
          py::arg("sigma_hit"), py::arg("lambda_short"), py::arg("max_range"));
  py::class_<BeamFan, std::shared_ptr<BeamFan>>(
      module, "BeamFan", "The beams of a range finder, sorted by direction; immutable.")
      .def(py::init(&make_fan), py::arg("ends"))
      .def_property_readonly("beams", &BeamFan::size);
  py::class_<RangeFinder, std::shared_ptr<RangeFinder>>(
      module, "RangeFinder",
      "A fan of beams with what stops them and how they are read; immutable.")
      .def(py::init(&make_finder), py::kw_only(), py::arg("fan").none(false), py::arg("origin"),
           py::arg("length"), py::arg("mask"), py::arg("reflect_mask"), py::arg("range_min"),
           py::arg("no_hit"), py::arg("noise"), py::arg("uses_materials"), py::arg("is_cone"))
      .def_property_readonly("beams", &RangeFinder::beams)
      .def_property_readonly("readings", &RangeFinder::readings)
      .def(
          "is_random",
          [](const RangeFinder& self, World& world) {
            world.check_readable();
            return self.is_random(world.rays());
          },
          py::arg("world"))
      .def("scan_labels", &py_scan_labels, py::arg("world"), py::arg("body"), py::arg("stream"),
           py::arg("update"))
      .def("scan", &py_scan, py::arg("world"), py::arg("body"), py::arg("stream"),
           py::arg("update"));
  module.def("scan_all", &py_scan_all, py::arg("jobs"), py::arg("out"), py::arg("num_threads"));
}

}  // namespace flatland
