#include "crowd/region.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <unordered_map>
#include <utility>

#include "world/errors.h"

namespace flatland::crowd {
namespace {

constexpr double kLeastGap = 2.0;        // [m]
constexpr double kMostColumns = 1024.0;  // of the cells that find out what belongs together

// What belongs together: sets of numbers that are joined.
class Sets {
 public:
  explicit Sets(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), std::size_t{0});
  }

  std::size_t root(std::size_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parents_[root(a)] = root(b); }

 private:
  std::vector<std::size_t> parents_;
};

// Joins segments and boxes by the cells that they touch.
class Neighbours {
 public:
  Neighbours(Vec low, double cell, std::size_t count) : low_(low), cell_(cell), sets_(count) {}

  void add(std::size_t number, const Segment& segment) {
    const auto [a, b] = segment.a.y < segment.b.y ? std::pair(segment.a, segment.b)
                                                  : std::pair(segment.b, segment.a);
    const std::int64_t first = row(a.y);
    const std::int64_t last = row(b.y);
    const double slope = (b.x - a.x) / (b.y - a.y);
    for (std::int64_t r = first; r <= last; ++r) {
      // The part of the segment in a row of cells.
      const double bottom = low_.y + static_cast<double>(r) * cell_;
      const double from = r == first ? a.x : a.x + slope * (bottom - a.y);
      const double to = r == last ? b.x : a.x + slope * (bottom + cell_ - a.y);
      mark(number, r, std::min(from, to), std::max(from, to));
    }
  }
  void add(std::size_t number, const Box& box) {
    for (std::int64_t r = row(box.low.y); r <= row(box.high.y); ++r) {
      mark(number, r, box.low.x, box.high.x);
    }
  }
  // Joins what is in adjacent cells.
  void join() {
    for (const auto& [key, number] : owners_) {
      for (const std::int64_t offset : {std::int64_t{1}, kRow - 1, kRow, kRow + 1}) {
        const auto other = owners_.find(key + offset);
        if (other != owners_.end()) sets_.join(number, other->second);
      }
    }
  }
  std::size_t set_of(std::size_t number) { return sets_.root(number); }

 private:
  static constexpr std::int64_t kRow = std::int64_t{1} << 32U;

  std::int64_t row(double y) const { return static_cast<std::int64_t>((y - low_.y) / cell_); }

  void mark(std::size_t number, std::int64_t row, double from, double to) {
    const auto last = static_cast<std::int64_t>((to - low_.x) / cell_);
    for (auto c = static_cast<std::int64_t>((from - low_.x) / cell_); c <= last; ++c) {
      const auto [owner, is_new] = owners_.try_emplace(row * kRow + c, number);
      if (!is_new) sets_.join(number, owner->second);
    }
  }

  Vec low_;
  double cell_;
  Sets sets_;
  std::unordered_map<std::int64_t, std::size_t> owners_;  // of the cells that are touched
};

bool fits(const Box& box, double cell) {
  return cell_size(box.widened(kBorder).size(), cell) <= cell;
}

Box box_of(const std::vector<Segment>& walls, const std::vector<Box>& places) {
  Box box = crowd::box_of(walls);
  for (const Box& place : places) box.add(place);
  return box;
}

// Returns the walls that belong together with places, or the greatest number of walls that belong
// together; nothing if there is a place without walls.
std::vector<Segment> walls_with(const std::vector<Segment>& walls, const std::vector<Box>& places,
                                double gap) {
  const std::size_t count = walls.size() + places.size();
  Neighbours neighbours(box_of(walls, places).low, gap, count);
  for (std::size_t i = 0; i < walls.size(); ++i) neighbours.add(i, walls[i]);
  for (std::size_t i = 0; i < places.size(); ++i) neighbours.add(walls.size() + i, places[i]);
  neighbours.join();
  std::vector<std::size_t> sizes(count, 0);
  for (std::size_t i = 0; i < walls.size(); ++i) ++sizes[neighbours.set_of(i)];
  std::vector<bool> is_kept(count, false);
  if (places.empty()) {
    is_kept[static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) -
                                     sizes.begin())] = true;
  }
  for (std::size_t i = walls.size(); i < count; ++i) {
    const std::size_t set = neighbours.set_of(i);
    if (sizes[set] == 0) return {};
    is_kept[set] = true;
  }
  std::vector<Segment> kept;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    if (is_kept[neighbours.set_of(i)]) kept.push_back(walls[i]);
  }
  return kept;
}

}  // namespace

void Box::add(Vec p) {
  low = is_empty ? p : Vec{std::min(low.x, p.x), std::min(low.y, p.y)};
  high = is_empty ? p : Vec{std::max(high.x, p.x), std::max(high.y, p.y)};
  is_empty = false;
}

void Box::add(const Box& other) {
  if (other.is_empty) return;
  add(other.low);
  add(other.high);
}

Box Box::widened(double margin) const {
  return {low - Vec{margin, margin}, high + Vec{margin, margin}, false};
}

bool Box::is_apart(const Box& other) const {
  return other.high.x < low.x || other.low.x > high.x || other.high.y < low.y ||
         other.low.y > high.y;
}

Box box_of(const std::vector<Segment>& segments) {
  Box box;
  for (const Segment& segment : segments) {
    box.add(segment.a);
    box.add(segment.b);
  }
  return box;
}

Region find_region(const std::vector<Segment>& walls, const std::vector<Box>& places, double cell) {
  const Box whole = box_of(walls, places);
  if (fits(whole, cell)) return {whole, false};
  std::vector<Segment> kept = walls;
  if (!fits(box_of({}, places), cell)) kept.clear();
  Box box = whole;
  const auto extent = [&] { return std::max(box.size().x, box.size().y); };
  for (double gap = 0.5 * extent();
       !kept.empty() && gap >= std::max(kLeastGap, extent() / kMostColumns); gap *= 0.5) {
    kept = walls_with(kept, places, gap);
    box = box_of(kept, places);
    if (!kept.empty() && fits(box, cell)) return {box, true};
  }
  const Vec size = whole.widened(kBorder).size();
  throw PhysicsError("the ways of people in an area of " + to_text(size.x) + " m x " +
                     to_text(size.y) + " m need " + to_text(size.x * size.y / (cell * cell)) +
                     " cells of " + to_text(cell) + " m, but at most " + to_text(kMostCells) +
                     " are possible");
}

std::vector<Segment> clipped(const std::vector<Segment>& segments, const Box& box) {
  std::vector<Segment> parts;
  for (const Segment& segment : segments) {
    const Vec along = segment.b - segment.a;
    double first = 0.0;
    double last = 1.0;
    // Liang and Barsky: the part of the segment between the lines of opposite sides.
    const auto cut = [&](double from, double slope, double low, double high) {
      if (slope == 0.0) {
        if (from < low || from > high) last = -1.0;
        return;
      }
      const auto [enter, leave] = std::minmax({(low - from) / slope, (high - from) / slope});
      first = std::max(first, enter);
      last = std::min(last, leave);
    };
    cut(segment.a.x, along.x, box.low.x, box.high.x);
    cut(segment.a.y, along.y, box.low.y, box.high.y);
    if (first > last) continue;
    // Segments that are completely inside keep their bits.
    parts.push_back({first > 0.0 ? segment.a + first * along : segment.a,
                     last < 1.0 ? segment.a + last * along : segment.b});
  }
  return parts;
}

}  // namespace flatland::crowd
