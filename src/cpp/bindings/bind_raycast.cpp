#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <tuple>

#include "bindings/bindings.h"
#include "rays/raycast.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

using Ends = py::array_t<float, py::array::c_style | py::array::forcecast>;
using PyPose = std::tuple<double, double, double>;

b2Transform checked_pose(const PyPose& pose) {
  const auto& [x, y, theta] = pose;
  b2Transform transform;
  transform.p = checked_vector(x, y, "pose");
  transform.q.Set(checked_finite(theta, "pose angle"));
  return transform;
}

// Checks and converts the arguments, casts without the GIL if there are more rays than `max_short`,
// and returns (fractions, reflect).
template <typename Cast>
py::tuple scan(World& world, const PyPose& pose, const Ends& ends, std::int64_t mask,
               std::int64_t reflect_mask, py::ssize_t max_short, Cast&& cast) {
  if (ends.ndim() != 2 || ends.shape(1) != 2) {
    throw py::value_error("ends must have shape (n, 2), got " +
                          std::string(py::str(ends.attr("shape"))));
  }
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
  return py::make_tuple(std::move(fractions), std::move(reflect));
}

py::tuple py_cast_rays(World& world, const PyPose& pose, const Ends& ends, std::int64_t mask,
                       std::int64_t reflect_mask) {
  constexpr py::ssize_t kShortScan = 2000;  // about 30 us
  return scan(world, pose, ends, mask, reflect_mask, kShortScan,
              [&](const BeamFan& fan, const ScanRequest& request, const ScanResult& result) {
                cast_rays(world.rays(), fan, request, result);
              });
}

py::tuple py_cast_rays_reference(World& world, const PyPose& pose, const Ends& ends,
                                 std::int64_t mask, std::int64_t reflect_mask) {
  return scan(world, pose, ends, mask, reflect_mask, 0,
              [&](const BeamFan&, const ScanRequest& request, const ScanResult& result) {
                cast_rays_reference(world.engine(), request, result);
              });
}

// Returns (fraction, point, normal, fixture, category_bits), or None for a miss.
py::object py_ray_cast(World& world, double from_x, double from_y, double to_x, double to_y,
                       std::int64_t mask) {
  const b2Vec2 from = checked_vector(from_x, from_y, "start");
  const b2Vec2 to = checked_vector(to_x, to_y, "end");
  world.check_readable();
  const auto hit = ray_cast(world.engine(), from, to, checked_bits(mask, "mask"));
  if (!hit) return py::none();
  return py::make_tuple(hit->fraction, py::make_tuple(hit->point.x, hit->point.y),
                        py::make_tuple(hit->normal.x, hit->normal.y), hit->fixture,
                        hit->category_bits);
}

}  // namespace

void bind_raycast(WorldClass& world) {
  world.def("ray_cast", &py_ray_cast);
  world.def("cast_rays", &py_cast_rays);
  world.def("cast_rays_reference", &py_cast_rays_reference);
}

}  // namespace flatland
