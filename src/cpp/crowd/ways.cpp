#include "crowd/ways.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

namespace flatland::crowd {
namespace {

// Returns the lists of gates near each cell that satisfy a condition.
SegmentGrid grid_of(const std::vector<Gate>& gates, const SegmentGrid::IsListed& is_listed) {
  constexpr double kCell = 0.5;  // m
  std::vector<Segment> centers;
  std::transform(gates.begin(), gates.end(), std::back_inserter(centers), [](const Gate& gate) {
    return Segment{gate.center, gate.center};
  });
  return {centers, kCell, kGateReach, is_listed};
}

SegmentGrid grid_in_view(const std::vector<Gate>& gates, const Walls& walls) {
  return grid_of(gates, [&](std::uint32_t i, Vec low, Vec high) {
    return walls.is_in_view(gates[i].center, low, high);
  });
}

// Returns the lists of gates that are not in view, but may be visible or contain a point.
SegmentGrid grid_of_others(const std::vector<Gate>& gates, const Walls& walls,
                           const SegmentGrid& in_view) {
  return grid_of(gates, [&](std::uint32_t i, Vec low, Vec high) {
    const Gate& gate = gates[i];
    const Vec center = 0.5 * (low + high);
    const SegmentGrid::Indices seen = in_view.near(center);  // both grids have the same cells
    if (std::binary_search(seen.begin(), seen.end(), i)) return false;
    const double reach = std::sqrt(gate.radius2) + length(high - center);
    return length(gate.center - center) <= reach || !walls.is_hidden(gate.center, low, high);
  });
}

}  // namespace

Way::Way(const FreeGrid& grid, std::shared_ptr<const Walls> walls, const std::vector<Gate>& gates,
         const Place& place)
    : place_(place), close_(3.0 * grid.cell()), walls_(std::move(walls)), field_(grid, place) {
  constexpr double kThrough = 0.3;  // least cosine of the angle between the way and the axis
  passages_.reserve(gates.size());
  for (const Gate& gate : gates) {
    // The way is taken at the center: next to a door post, the way may lead in any direction.
    const double cosine = dot(from(gate.center), gate.axis);
    passages_.push_back(std::fabs(cosine) < kThrough ? kNoPassage : cosine > 0.0 ? 1 : 0);
  }
}

Vec Way::from(Vec p) const {
  const Vec straight = place_.nearest(p) - p;
  if (square(straight) < close_ * close_ && walls_->is_clear(p, p + straight)) {
    return unit(straight);
  }
  return field_.direction(p, *walls_);
}

Ways::Ways(FreeGrid grid, std::shared_ptr<const Walls> walls)
    : grid_(std::move(grid)),
      walls_(std::move(walls)),
      gates_(find_gates(grid_, *walls_)),
      gates_in_view_(grid_in_view(gates_, *walls_)),
      other_gates_(grid_of_others(gates_, *walls_, gates_in_view_)) {}

std::shared_ptr<const Way> Ways::to(const Place& place) {
  Entry* entry = nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    // The nodes of a map remain where they are.
    entry = &entries_[{place.low.x, place.low.y, place.high.x, place.high.y, place.radius}];
  }
  std::call_once(entry->is_computed, [&] { entry->way = to_temporary(place); });
  return entry->way;
}

std::shared_ptr<const Way> Ways::to_temporary(const Place& place) const {
  return std::make_shared<const Way>(grid_, walls_, gates_, place);
}

}  // namespace flatland::crowd
