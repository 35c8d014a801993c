// Runs of steps as tuples of Python.
#pragma once

#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "world/errors.h"

namespace flatland {

// The members of a Run, in order.
using PyRun = std::tuple<std::int64_t, std::int64_t, std::int64_t, double, int, int, bool, bool>;
using PyRunResult = std::tuple<std::int64_t, int, std::vector<Id>,
                               std::vector<std::pair<Id, std::string>>, std::optional<PyReport>>;

inline Run to_run(const PyRun& run) {
  const auto& [time, step, n, dt, velocity, position, continues, calls_physics] = run;
  return {time, step, n, dt, velocity, position, continues, calls_physics};
}

inline PyRunResult result_tuple(const RunResult& result) {
  std::vector<std::pair<Id, std::string>> failed;
  for (const FailedJob& job : result.failed) failed.emplace_back(job.controller, job.error);
  return {result.steps, static_cast<int>(result.end), result.calls, std::move(failed),
          to_python(result.report)};
}

// Converts an exception to an instance of the Python class that pybind11 would raise.
inline pybind11::object error_of(const std::exception_ptr& error) {
  const auto errors = pybind11::module_::import("flatland.errors");
  const auto builtins = pybind11::module_::import("builtins");
  try {
    std::rethrow_exception(error);
  } catch (const StaleHandleError& stale) {
    return errors.attr("StaleHandleError")(stale.what());
  } catch (const WorldLockedError& locked) {
    return errors.attr("WorldLockedError")(locked.what());
  } catch (const std::invalid_argument& invalid) {
    return builtins.attr("ValueError")(invalid.what());
  } catch (const std::exception& other) {
    return builtins.attr("MemoryError")(other.what());
  }
}

}  // namespace flatland
