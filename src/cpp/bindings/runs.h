// Arguments and results of runs of steps, for their bindings.
#pragma once

#include <cstdint>
#include <string>

#include "bindings/bindings.h"

namespace flatland {

// Steps are counted in 64 bits with a margin.
inline std::int64_t checked_step(std::int64_t step) {
  constexpr std::int64_t kMost = std::int64_t{1} << 61;
  if (step < 0 || step > kMost) {
    throw pybind11::value_error("numbers of steps must be from 0 to 2^61, got " +
                                std::to_string(step));
  }
  return step;
}

inline pybind11::tuple to_python(const RunResult& result) {
  return pybind11::make_tuple(result.steps, static_cast<int>(result.end), to_python(result.report));
}

}  // namespace flatland
