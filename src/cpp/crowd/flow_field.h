// The ways to a place: the direction of the fastest way from each cell of a grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "crowd/walls.h"
#include "vec.h"

namespace flatland::crowd {

// The points within `radius` of a rectangle, which may be a single point.
struct Place {
  Vec low, high;
  double radius = 0.0;

  Vec nearest(Vec p) const;
  bool contains(Vec p) const { return length(nearest(p) - p) <= radius; }
};

// Square cells with the time that a disc takes to cross each cell. The time is longer near walls,
// so that the fastest ways keep a distance from walls. Immutable.
class FreeGrid {
 public:
  // Creates cells of the size `cell` [m] for a disc of a radius [m].
  FreeGrid(const Walls& walls, Vec low, Vec high, double cell, double radius);

  // Returns the distance within which walls have an effect on a disc of a radius [m].
  static double range(double radius) { return radius + kClearance; }

  std::int64_t columns() const { return columns_; }
  std::int64_t rows() const { return rows_; }
  double cell() const { return cell_; }
  Vec low() const { return low_; }
  Vec center(std::size_t index) const;
  // Returns the time to cross a metre at a speed of 1 m/s; 0 if the disc does not fit.
  float slowness(std::size_t index) const { return slowness_[index]; }

 private:
  static constexpr double kClearance = 0.4;  // gap beyond which a wall has no effect [m]

  Vec low_;
  double cell_;
  std::int64_t columns_, rows_;
  std::vector<float> slowness_;
};

// Immutable, so that copies of a crowd share it.
class FlowField {
 public:
  FlowField(const FreeGrid& grid, const Place& place);
  // Returns the ways to the border of a grid.
  static FlowField outwards(const FreeGrid& grid);

  // Returns the number of cells from which there is a way.
  std::size_t reached() const { return reached_; }
  // Returns the unit vector of the way from a point, a zero vector if there is none. From a point
  // at which the disc does not fit, the way leads to the nearest visible cell with a way.
  Vec direction(Vec p, const Walls& walls) const;
  // Begins to load what `direction` reads for a point into the cache: a field is large.
  void prefetch(Vec p) const;

 private:
  FlowField(const FreeGrid& grid, const Place& place, const std::vector<std::size_t>& starts);

  // A vector of the length kUnit; (0, 0) if there is no way.
  struct Direction {
    std::int8_t x = 0, y = 0;
  };

  // The cells are stored in tiles, each in a line of the cache, and the tiles in blocks, each in a
  // page of memory. A person walks within a tile for some updates, and within a block for some
  // seconds.
  static constexpr std::size_t kTileColumns = 8;
  static constexpr std::size_t kTileRows = 4;
  static constexpr std::size_t kTilesPerRow = 8;
  static constexpr std::size_t kBlockColumns = kTilesPerRow * kTileColumns;
  static constexpr std::size_t kBlockRows = kTilesPerRow * kTileRows;
  using Tile = std::array<Direction, kTileColumns * kTileRows>;
  struct alignas(4096) Block {
    std::array<Tile, kTilesPerRow * kTilesPerRow> tiles;
  };

  Direction& at(std::int64_t column, std::int64_t row) {
    const auto x = static_cast<std::size_t>(column);
    const auto y = static_cast<std::size_t>(row);
    Block& block = blocks_[y / kBlockRows * blocks_per_row_ + x / kBlockColumns];
    Tile& tile =
        block.tiles[y % kBlockRows / kTileRows * kTilesPerRow + x % kBlockColumns / kTileColumns];
    return tile[y % kTileRows * kTileColumns + x % kTileColumns];
  }
  const Direction& at(std::int64_t column, std::int64_t row) const {
    return const_cast<FlowField*>(this)->at(column, row);
  }

  Vec low_;
  double cell_;
  std::int64_t columns_, rows_;
  std::size_t blocks_per_row_;
  std::vector<Block> blocks_;
  std::size_t reached_ = 0;
};

}  // namespace flatland::crowd
