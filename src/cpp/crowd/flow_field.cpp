#include "crowd/flow_field.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "prefetch.h"

namespace flatland::crowd {
namespace {

constexpr double kMostSlowness = 4.0;  // time to cross a metre next to a wall [s]
constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr double kUnit = 127.0;  // length of the stored directions

// The arrival times at the cells, by the fast marching method: J. Sethian, "A fast marching level
// set method for monotonically advancing fronts", Proc. Natl. Acad. Sci. 93 (1996).
class Front {
 public:
  explicit Front(const FreeGrid& grid)
      : grid_(grid),
        times_(static_cast<std::size_t>(grid.columns() * grid.rows()), kNever),
        is_final_(times_.size(), false) {}

  void start(std::size_t cell) {
    times_[cell] = 0.0F;
    front_.push({0.0F, cell});
  }

  void advance() {
    const auto columns = static_cast<std::size_t>(grid_.columns());
    while (!front_.empty()) {
      const std::size_t cell = front_.top().second;
      front_.pop();
      if (is_final_[cell]) continue;
      is_final_[cell] = true;
      const std::size_t column = cell % columns;
      if (column > 0) update(cell - 1);
      if (column + 1 < columns) update(cell + 1);
      if (cell >= columns) update(cell - columns);
      if (cell + columns < times_.size()) update(cell + columns);
    }
  }

  float time(std::int64_t column, std::int64_t row) const {
    if (column < 0 || row < 0 || column >= grid_.columns() || row >= grid_.rows()) return kNever;
    return times_[static_cast<std::size_t>(row * grid_.columns() + column)];
  }

 private:
  void update(std::size_t cell) {
    if (is_final_[cell] || grid_.slowness(cell) == 0.0F) return;
    const auto column = static_cast<std::int64_t>(cell) % grid_.columns();
    const auto row = static_cast<std::int64_t>(cell) / grid_.columns();
    double first = std::min(time(column - 1, row), time(column + 1, row));
    double second = std::min(time(column, row - 1), time(column, row + 1));
    if (first > second) std::swap(first, second);
    const double crossing = grid_.cell() * static_cast<double>(grid_.slowness(cell));
    double arrival = first + crossing;
    if (arrival > second) {
      const double difference = second - first;
      arrival =
          0.5 * (first + second + std::sqrt(2.0 * crossing * crossing - difference * difference));
    }
    const auto rounded = static_cast<float>(arrival);
    if (rounded >= times_[cell]) return;
    times_[cell] = rounded;
    front_.push({rounded, cell});
  }

  using Entry = std::pair<float, std::size_t>;

  const FreeGrid& grid_;
  std::vector<float> times_;
  std::vector<bool> is_final_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front_;
};

// Returns the greatest integer that is not greater than a number; std::floor is a call of a
// library.
std::int64_t floored(double number) {
  const auto truncated = static_cast<std::int64_t>(number);
  return static_cast<double>(truncated) > number ? truncated - 1 : truncated;
}

// Returns the free cells within a distance of a place without its radius: a part of the disc around
// the place may be on the other side of a wall.
std::vector<std::size_t> cells_at(const FreeGrid& grid, const Place& place) {
  const double reach = 0.75 * grid.cell();
  std::vector<std::size_t> cells;
  for (std::size_t i = 0; i < static_cast<std::size_t>(grid.columns() * grid.rows()); ++i) {
    const Vec center = grid.center(i);
    const bool is_near = length(place.nearest(center) - center) <= reach;
    if (grid.slowness(i) > 0.0F && is_near) cells.push_back(i);
  }
  return cells;
}

// Returns the derivative of the arrival time on the side from which the front arrived.
double upwind(float before, float here, float after) {
  if (std::min(before, after) >= here) return 0.0;
  return before < after ? static_cast<double>(here - before) : static_cast<double>(after - here);
}

}  // namespace

Vec Place::nearest(Vec p) const {
  return {std::min(std::max(p.x, low.x), high.x), std::min(std::max(p.y, low.y), high.y)};
}

FreeGrid::FreeGrid(const Walls& walls, Vec low, Vec high, double cell, double radius)
    : low_(low), cell_(cell) {
  const Vec size = high - low;
  columns_ = static_cast<std::int64_t>(size.x / cell_) + 1;
  rows_ = static_cast<std::int64_t>(size.y / cell_) + 1;
  slowness_.resize(static_cast<std::size_t>(columns_ * rows_));
  for (std::size_t i = 0; i < slowness_.size(); ++i) {
    const double gap = walls.distance(center(i), range(radius)) - radius;
    const double slowness = std::min(kClearance / std::max(gap, 1e-9), kMostSlowness);
    slowness_[i] = gap < 0.0 ? 0.0F : static_cast<float>(slowness);
  }
}

Vec FreeGrid::center(std::size_t index) const {
  const auto i = static_cast<std::int64_t>(index);
  return {low_.x + (static_cast<double>(i % columns_) + 0.5) * cell_,
          low_.y + (static_cast<double>(i / columns_) + 0.5) * cell_};
}

FlowField::FlowField(const FreeGrid& grid, const Place& place)
    : FlowField(grid, place, cells_at(grid, place)) {}

FlowField FlowField::outwards(const FreeGrid& grid) {
  std::vector<std::size_t> border;
  const auto columns = static_cast<std::size_t>(grid.columns());
  const auto count = columns * static_cast<std::size_t>(grid.rows());
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_inside =
        i >= columns && i + columns < count && i % columns != 0 && (i + 1) % columns != 0;
    if (!is_inside && grid.slowness(i) > 0.0F) border.push_back(i);
  }
  return {grid, Place{}, border};
}

FlowField::FlowField(const FreeGrid& grid, const Place& place,
                     const std::vector<std::size_t>& starts)
    : low_(grid.low()),
      cell_(grid.cell()),
      columns_(grid.columns()),
      rows_(grid.rows()),
      blocks_per_row_(static_cast<std::size_t>(columns_) / kBlockColumns + 1) {
  Front front(grid);
  blocks_.resize(blocks_per_row_ * (static_cast<std::size_t>(rows_) / kBlockRows + 1));
  for (const std::size_t cell : starts) front.start(cell);
  front.advance();
  for (std::int64_t row = 0; row < rows_; ++row) {
    for (std::int64_t column = 0; column < columns_; ++column) {
      const float here = front.time(column, row);
      if (here == kNever) continue;
      ++reached_;
      const Vec slope{upwind(front.time(column - 1, row), here, front.time(column + 1, row)),
                      upwind(front.time(column, row - 1), here, front.time(column, row + 1))};
      // The slope is zero at the place itself.
      const Vec center = grid.center(static_cast<std::size_t>(row * columns_ + column));
      const Vec direction = unit(-slope, unit(place.nearest(center) - center, {1.0, 0.0}));
      at(column, row) = {static_cast<std::int8_t>(std::lround(kUnit * direction.x)),
                         static_cast<std::int8_t>(std::lround(kUnit * direction.y))};
    }
  }
}

void FlowField::prefetch(Vec p) const {
  const std::int64_t column = cell_index((p.x - low_.x) / cell_ - 0.5, columns_);
  const std::int64_t row = cell_index((p.y - low_.y) / cell_ - 0.5, rows_);
  for (const std::int64_t each : {row, std::min(row + 1, rows_ - 1)}) {
    flatland::prefetch(&at(column, each), sizeof(Direction));
  }
}

Vec FlowField::direction(Vec p, const Walls& walls) const {
  const double x = (p.x - low_.x) / cell_ - 0.5;
  const double y = (p.y - low_.y) / cell_ - 0.5;
  constexpr double kMargin = 8.0;  // cells
  if (!(x > -kMargin && y > -kMargin && x < static_cast<double>(columns_) + kMargin &&
        y < static_cast<double>(rows_) + kMargin)) {
    return {};
  }
  const std::int64_t column = floored(x);
  const std::int64_t row = floored(y);
  const auto stored = [&](std::int64_t c, std::int64_t r) {
    return c < 0 || r < 0 || c >= columns_ || r >= rows_ ? Direction{} : at(c, r);
  };
  const double u = x - static_cast<double>(column);
  const double v = y - static_cast<double>(row);
  Vec sum;
  for (int i = 0; i < 4; ++i) {
    const Direction d = stored(column + i % 2, row + i / 2);
    const double weight = (i % 2 == 1 ? u : 1.0 - u) * (i / 2 == 1 ? v : 1.0 - v);
    sum += weight * Vec{static_cast<double>(d.x), static_cast<double>(d.y)};
  }
  if (square(sum) > 1.0) return unit(sum);
  // The point is outside the free space, for example after a push. Search for the nearest cell with
  // a way.
  constexpr std::int64_t kSearch = 4;
  double nearest = std::numeric_limits<double>::infinity();
  Vec target;
  for (std::int64_t r = row - kSearch; r <= row + kSearch; ++r) {
    for (std::int64_t c = column - kSearch; c <= column + kSearch; ++c) {
      const Direction d = stored(c, r);
      if (d.x == 0 && d.y == 0) continue;
      const Vec offset{static_cast<double>(c) - x, static_cast<double>(r) - y};
      if (square(offset) < nearest && walls.is_clear(p, p + cell_ * offset)) {
        nearest = square(offset);
        target = offset;
      }
    }
  }
  return unit(target);
}

}  // namespace flatland::crowd
