// The ways to the places of a crowd, with what they have in common: a grid and the doors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "crowd/flow_field.h"
#include "crowd/gates.h"
#include "crowd/walls.h"
#include "vec.h"

namespace flatland::crowd {

// The ways to a place from everywhere. Immutable, so that copies of a crowd share it.
class Way {
 public:
  Way(const FreeGrid& grid, std::shared_ptr<const Walls> walls, const std::vector<Gate>& gates,
      const Place& place);

  const FlowField& field() const { return field_; }
  // Returns the unit vector of the way from a point, a zero vector if there is none. Next to the
  // place, where the directions of the grid are too coarse, the way is a straight line.
  Vec from(Vec p) const;
  // Returns the direction in which the way passes a gate, see Demand; kNoPassage if it does not.
  int through(std::size_t gate) const { return passages_[gate]; }
  static constexpr int kNoPassage = -1;

 private:
  Place place_;
  double close_;  // distance from the place that counts as next to it [m]
  std::shared_ptr<const Walls> walls_;
  FlowField field_;
  std::vector<std::int8_t> passages_;
};

// The ways between walls to places that people walk to again and again. Each way is computed when
// it is first needed. Copies of a crowd share the object, also if they advance in different
// threads.
class Ways {
 public:
  Ways(FreeGrid grid, std::shared_ptr<const Walls> walls);

  const FreeGrid& grid() const { return grid_; }
  const std::vector<Gate>& gates() const { return gates_; }
  // Returns the indices of gates that are visible from a point, in ascending order: of those within
  // a distance of `kGateReach`, all that are visible from its whole cell.
  SegmentGrid::Indices gates_in_view(Vec p) const { return gates_in_view_.near(p); }
  // Returns the indices of all further gates within this distance that are visible or contain the
  // point, in ascending order, and of few others.
  SegmentGrid::Indices other_gates(Vec p) const { return other_gates_.near(p); }
  std::shared_ptr<const Way> to(const Place& place);
  // Returns a way that is not kept.
  std::shared_ptr<const Way> to_temporary(const Place& place) const;

 private:
  using Key = std::array<double, 5>;

  struct Entry {
    std::once_flag is_computed;
    std::shared_ptr<const Way> way;
  };

  const FreeGrid grid_;
  const std::shared_ptr<const Walls> walls_;
  const std::vector<Gate> gates_;
  const SegmentGrid gates_in_view_, other_gates_;
  std::mutex mutex_;
  std::map<Key, Entry> entries_;  // by the numbers of the place
};

}  // namespace flatland::crowd
