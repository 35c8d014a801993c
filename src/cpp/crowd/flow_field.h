// The ways to a place: on a grid of the free space, the direction of the fastest way from each
// cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "crowd/vec.h"
#include "crowd/walls.h"

namespace flatland::crowd {

// The points within `radius` of a rectangle, which may be a single point.
struct Place {
  Vec low, high;
  double radius = 0.0;

  Vec nearest(Vec p) const;
  bool contains(Vec p) const { return length(nearest(p) - p) <= radius; }
};

// Square cells with the time that a disc takes to cross them: more near walls, so that the ways
// keep a distance from them. Immutable.
class FreeGrid {
 public:
  // `radius` is that of the disc [m], `cell` the size of the cells, which are larger if they would
  // be too many.
  FreeGrid(const Walls& walls, Vec low, Vec high, double cell, double radius);

  std::int64_t columns() const { return columns_; }
  std::int64_t rows() const { return rows_; }
  double cell() const { return cell_; }
  Vec low() const { return low_; }
  Vec center(std::size_t index) const;
  // Time to cross a metre at a speed of 1 m/s; 0 if the disc does not fit.
  float slowness(std::size_t index) const { return slowness_[index]; }

 private:
  Vec low_;
  double cell_;
  std::int64_t columns_, rows_;
  std::vector<float> slowness_;
};

// Immutable, so that copies of a crowd share it.
class FlowField {
 public:
  FlowField(const FreeGrid& grid, const Place& place);

  // Number of cells from which there is a way.
  std::size_t reached() const { return reached_; }
  // Returns the unit vector of the way from a point; 0 if there is none. From a point at which the
  // disc does not fit, it leads to the nearest cell with a way that no wall hides.
  Vec direction(Vec p, const Walls& walls) const;

 private:
  struct Direction {
    std::int8_t x = 0, y = 0;  // both 0 without a way
  };

  std::size_t index(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>(row * columns_ + column);
  }

  Vec low_;
  double cell_;
  std::int64_t columns_, rows_;
  std::vector<Direction> directions_;
  std::size_t reached_ = 0;
};

}  // namespace flatland::crowd
