#include "crowd/gates.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>

namespace flatland::crowd {
namespace {

constexpr double kWidth = 1.35;      // greatest width of a passage [m]
constexpr double kOpposite = -0.8;   // cosine of the angle between directions to opposite walls
constexpr double kMostDepth = 3.0;   // greatest half of the length of a passage [m]
constexpr double kMostOffset = 0.9;  // greatest distance of a cell from the axis of a passage [m]
constexpr double kOpen = 8.0;        // time for one direction while people wait in the other [s]
constexpr double kClearing = 6.0;    // further time until people in the passage turn back [s]

// The cross-section of a passage at a cell.
struct Throat {
  std::size_t cell = 0;
  Vec a, b;  // the nearest points of the opposite walls
  double width = 0.0;
};

// Returns whether a point is between opposite walls that are close to each other, and sets the
// cross-section in this case.
bool is_between(const Walls& walls, Vec p, std::vector<NearPoint>& near, Throat& throat) {
  near.clear();
  walls.find_near(p, kWidth, near);
  if (near.empty()) return false;
  const auto nearest =
      std::min_element(near.begin(), near.end(), [](const NearPoint& a, const NearPoint& b) {
        return std::tie(a.distance, a.point.x, a.point.y) <
               std::tie(b.distance, b.point.x, b.point.y);
      });
  const Vec direction = unit(nearest->point - p);
  throat.width = kWidth;
  for (const NearPoint& other : near) {
    if (dot(direction, unit(other.point - p)) > kOpposite) continue;
    const double width = length(other.point - nearest->point);
    if (width >= throat.width) continue;
    throat.a = nearest->point;
    throat.b = other.point;
    throat.width = width;
  }
  return throat.width < kWidth;
}

// Returns the connected narrow cells that contain a first cell, and marks them by a width of 0.
std::vector<Throat> passage_from(std::size_t first, const FreeGrid& grid,
                                 std::vector<Throat>& narrow) {
  std::vector<Throat> passage;
  std::vector<std::size_t> pending{first};
  const auto columns = static_cast<std::size_t>(grid.columns());
  const auto take = [&](std::size_t cell) {
    passage.push_back(narrow[cell]);
    narrow[cell].width = 0.0;
  };
  take(first);
  while (!pending.empty()) {
    const std::size_t cell = pending.back();
    pending.pop_back();
    const std::size_t column = cell % columns;
    for (std::size_t c = column - (column > 0); c <= std::min(column + 1, columns - 1); ++c) {
      for (int row = -1; row <= 1; ++row) {
        const std::size_t next = cell - column + c + static_cast<std::size_t>(row) * columns;
        if (next >= narrow.size() || narrow[next].width == 0.0) continue;
        take(next);
        pending.push_back(next);
      }
    }
  }
  return passage;
}

}  // namespace

std::vector<Gate> find_gates(const FreeGrid& grid, const Walls& walls) {
  std::vector<Throat> narrow(static_cast<std::size_t>(grid.columns() * grid.rows()));
  const Walls within_width(walls.segments(), kWidth);
  std::vector<NearPoint> near;
  for (std::size_t i = 0; i < narrow.size(); ++i) {
    if (grid.slowness(i) <= 1.0F) continue;  // a disc does not fit, or all walls are far away
    if (is_between(within_width, grid.center(i), near, narrow[i])) {
      narrow[i].cell = i;
    } else {
      narrow[i].width = 0.0;
    }
  }
  std::vector<Gate> gates;
  for (std::size_t i = 0; i < narrow.size(); ++i) {
    if (narrow[i].width == 0.0) continue;
    const std::vector<Throat> passage = passage_from(i, grid, narrow);
    // The middle is the cell nearest to the axis among the narrowest cells.
    const auto middle =
        std::min_element(passage.begin(), passage.end(), [&](const Throat& s, const Throat& t) {
          const auto rank = [&](const Throat& throat) {
            const Vec center = grid.center(throat.cell);
            return std::tuple(std::lround(throat.width / (0.5 * grid.cell())),
                              length(center - 0.5 * (throat.a + throat.b)), throat.cell);
          };
          return rank(s) < rank(t);
        });
    Gate gate;
    gate.center = 0.5 * (middle->a + middle->b);
    gate.axis = left_of(unit(middle->b - middle->a, {0.0, 1.0}));
    gate.half_width = 0.5 * middle->width;
    double offset = 0.0;
    for (const Throat& throat : passage) {
      const Vec from_center = grid.center(throat.cell) - gate.center;
      gate.half_depth = std::max(gate.half_depth, std::fabs(dot(from_center, gate.axis)));
      offset = std::max(offset, std::fabs(cross(from_center, gate.axis)));
    }
    gate.radius2 = square({gate.half_length(), gate.half_width});
    // A cluttered place has no axis.
    if (gate.half_depth <= kMostDepth && offset <= kMostOffset) gates.push_back(gate);
  }
  std::sort(gates.begin(), gates.end(), [](const Gate& a, const Gate& b) {
    return std::tie(a.center.x, a.center.y) < std::tie(b.center.x, b.center.y);
  });
  return gates;
}

void Signal::update(const Demand& demand, std::int64_t step, double dt) {
  const bool is_wanted[2] = {demand.inside[0] + demand.waiting[0] > 0,
                             demand.inside[1] + demand.waiting[1] > 0};
  is_closing = false;
  if (!is_wanted[0] || !is_wanted[1]) {
    direction = is_wanted[0] ? 0 : is_wanted[1] ? 1 : -1;
    opposed_since = 0;
    return;
  }
  if (direction < 0) {
    direction = demand.inside[0] != demand.inside[1] ? demand.inside[1] > demand.inside[0]
                                                     : demand.nearest[1] < demand.nearest[0];
  }
  if (opposed_since == 0) opposed_since = step;
  const double opposed = static_cast<double>(step - opposed_since) * dt;
  is_closing = opposed > kOpen || demand.waiting[direction] == 0;
  const bool is_clear = is_closing && demand.inside[direction] == 0;
  if (is_clear || opposed > kOpen + kClearing) {
    direction = static_cast<std::int8_t>(1 - direction);
    is_closing = false;
    opposed_since = step;
  }
}

}  // namespace flatland::crowd
