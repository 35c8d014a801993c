// Where a job stands in the order of a step.
#pragma once

#include <cstdint>
#include <tuple>

namespace flatland {

// The order of a plugin, from 1 on, or 0 for what belongs to no plugin; and the number of a job
// among those of the plugin.
struct JobPlace {
  std::int64_t order = 0;
  std::int64_t number = 0;

  bool operator<(const JobPlace& other) const {
    return std::tie(order, number) < std::tie(other.order, other.number);
  }
};

}  // namespace flatland
