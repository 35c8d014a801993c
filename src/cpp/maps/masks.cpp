#include "maps/masks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <tuple>
#include <utility>

namespace flatland {
namespace {

// Widens the on pixels of a row: pixel i of the result is on if one of the `width` pixels from i on
// is. The last width - 1 pixels of the row have no result, and keep arbitrary values.
class Widener {
 public:
  explicit Widener(std::size_t length) : from_(length), to_(length) {}

  const std::uint8_t* widen(const std::vector<std::uint8_t>& row, std::size_t width) {
    from_ = row;
    std::size_t done = 1;
    while (done < width) {
      const std::size_t shift = std::min(done, width - done);
      combine(shift);
      done += shift;
    }
    return from_.data();
  }

 private:
  void combine(std::size_t shift) {
    const std::size_t count = from_.size() - shift;
    const std::uint8_t* from = from_.data();
    std::uint8_t* to = to_.data();
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = static_cast<std::uint8_t>(from[i] | from[i + shift]);
    }
    std::swap(from_, to_);
  }

  std::vector<std::uint8_t> from_, to_;
};

}  // namespace

std::vector<std::uint8_t> dilated(const Bitmap& bitmap, const std::vector<ShapeRun>& shape,
                                  bool outside) {
  const auto rows = static_cast<std::ptrdiff_t>(bitmap.rows);
  const std::size_t cols = bitmap.cols;
  std::vector<std::uint8_t> result(bitmap.rows * cols, 0);
  // Rows of equal runs are widened only once.
  std::vector<ShapeRun> runs = shape;
  std::sort(runs.begin(), runs.end(), [](const ShapeRun& a, const ShapeRun& b) {
    return std::tie(a.first, a.last, a.row) < std::tie(b.first, b.last, b.row);
  });
  std::ptrdiff_t left = 0;
  std::ptrdiff_t right = 0;
  for (const ShapeRun& run : runs) {
    left = std::max<std::ptrdiff_t>(left, -run.first);
    right = std::max<std::ptrdiff_t>(right, run.last);
    // The part of the result around which the run lies beyond the first or the last row.
    if (!outside) continue;
    for (std::ptrdiff_t y = 0; y < rows; ++y) {
      if (y + run.row >= 0 && y + run.row < rows) continue;
      std::fill_n(result.begin() + y * static_cast<std::ptrdiff_t>(cols), cols, std::uint8_t{1});
    }
  }
  std::vector<std::uint8_t> padded(cols + static_cast<std::size_t>(left + right), outside);
  Widener widener(padded.size());
  for (std::ptrdiff_t source = 0; source < rows; ++source) {
    const std::uint8_t* pixels = bitmap.pixels + static_cast<std::size_t>(source) * cols;
    std::transform(pixels, pixels + cols, padded.begin() + left,
                   [](std::uint8_t pixel) { return static_cast<std::uint8_t>(pixel != 0); });
    const std::uint8_t* widened = nullptr;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const ShapeRun& run = runs[i];
      if (i == 0 || run.first != runs[i - 1].first || run.last != runs[i - 1].last) {
        widened = widener.widen(padded, static_cast<std::size_t>(run.last - run.first) + 1);
      }
      const std::ptrdiff_t y = source - run.row;
      if (y < 0 || y >= rows) continue;
      const std::uint8_t* from = widened + left + run.first;
      std::uint8_t* to = result.data() + static_cast<std::size_t>(y) * cols;
      for (std::size_t x = 0; x < cols; ++x) to[x] = static_cast<std::uint8_t>(to[x] | from[x]);
    }
  }
  return result;
}

namespace {

// Provisional regions, some of which are found to be the same. The number 0 stands for no region.
class Regions {
 public:
  std::int32_t add() {
    parents_.push_back(static_cast<std::int32_t>(parents_.size()));
    firsts_.push_back(std::numeric_limits<std::size_t>::max());
    return parents_.back();
  }
  std::int32_t merge(std::int32_t a, std::int32_t b) {
    a = root_of(a);
    b = root_of(b);
    parent(std::max(a, b)) = std::min(a, b);
    return std::min(a, b);
  }
  // Adds a part that starts at a place, in the order of which regions are numbered.
  void add_part(std::int32_t region, std::size_t place) {
    std::size_t& first = firsts_[static_cast<std::size_t>(region)];
    first = std::min(first, place);
  }
  // Returns the final number of each provisional one.
  std::vector<std::int32_t> numbers() {
    std::vector<std::pair<std::size_t, std::int32_t>> ordered;
    for (std::int32_t region = 1; region < static_cast<std::int32_t>(parents_.size()); ++region) {
      parent(region) = parent(parent(region));  // parents have lower numbers
      add_part(parent(region), firsts_[static_cast<std::size_t>(region)]);
    }
    for (std::int32_t region = 1; region < static_cast<std::int32_t>(parents_.size()); ++region) {
      const std::size_t first = firsts_[static_cast<std::size_t>(region)];
      if (parent(region) == region) ordered.emplace_back(first, region);
    }
    std::sort(ordered.begin(), ordered.end());
    std::vector<std::int32_t> of_roots(parents_.size(), 0);
    std::int32_t count = 0;
    for (const auto& [first, root] : ordered) of_roots[static_cast<std::size_t>(root)] = ++count;
    std::vector<std::int32_t> numbers;
    for (const std::int32_t root : parents_) {
      numbers.push_back(of_roots[static_cast<std::size_t>(root)]);
    }
    return numbers;
  }

 private:
  std::int32_t& parent(std::int32_t region) { return parents_[static_cast<std::size_t>(region)]; }
  std::int32_t root_of(std::int32_t region) {
    while (parent(region) != region) {
      parent(region) = parent(parent(region));
      region = parent(region);
    }
    return region;
  }

  std::vector<std::int32_t> parents_{0};
  std::vector<std::size_t> firsts_{0};
};

}  // namespace

std::vector<std::int32_t> connected_regions(const Bitmap& bitmap, bool diagonally) {
  const std::size_t cols = bitmap.cols;
  const std::size_t block = diagonally ? 2 : 1;
  std::vector<std::int32_t> labels(bitmap.rows * cols, 0);
  Regions regions;
  for (std::size_t y = 0; y < bitmap.rows; ++y) {
    const std::uint8_t* pixels = bitmap.pixels + y * cols;
    std::int32_t* row = labels.data() + y * cols;
    std::size_t end = 0;
    for (std::size_t start = 0; start < cols; start = end) {
      end = start + 1;
      if (pixels[start] == 0) continue;
      while (end < cols && pixels[end] != 0) ++end;
      // The run belongs to the regions of all runs above that it touches.
      std::int32_t label = 0;
      if (y > 0) {
        const std::int32_t* above = row - cols;
        std::int32_t last = 0;
        const std::size_t reach = diagonally ? 1 : 0;
        for (std::size_t x = start - std::min(start, reach); x < std::min(end + reach, cols); ++x) {
          if (above[x] == last) continue;
          last = above[x];
          if (last != 0) label = label == 0 ? last : regions.merge(label, last);
        }
      }
      if (label == 0) label = regions.add();
      regions.add_part(label, y / block * cols + start / block);
      std::fill(row + start, row + end, label);
    }
  }
  const std::vector<std::int32_t> numbers = regions.numbers();
  for (std::int32_t& label : labels) label = numbers[static_cast<std::size_t>(label)];
  return labels;
}

namespace {

// Returns whether all pixels of a line between two pixels are on.
bool is_line_on(const Bitmap& bitmap, Pixel a, Pixel b) {
  const auto rows = static_cast<std::int64_t>(b.row) - static_cast<std::int64_t>(a.row);
  const auto cols = static_cast<std::int64_t>(b.col) - static_cast<std::int64_t>(a.col);
  const std::int64_t n = std::max<std::int64_t>({std::abs(rows), std::abs(cols), 1});
  for (std::int64_t i = 0; i <= n; ++i) {
    const std::size_t row = a.row + static_cast<std::size_t>(rows * i / n);
    const std::size_t col = a.col + static_cast<std::size_t>(cols * i / n);
    if (bitmap.pixels[row * bitmap.cols + col] == 0) return false;
  }
  return true;
}

}  // namespace

bool are_connected(const Bitmap& bitmap, Pixel a, Pixel b, Pixel low, Pixel high) {
  // The straight line is the usual path, and much faster to examine than the whole window.
  if (is_line_on(bitmap, a, b)) return true;
  const std::size_t cols = high.col - low.col + 1;
  std::vector<std::uint8_t> pixels;
  for (std::size_t row = low.row; row <= high.row; ++row) {
    const std::uint8_t* first = bitmap.pixels + row * bitmap.cols + low.col;
    pixels.insert(pixels.end(), first, first + cols);
  }
  const Bitmap window{pixels.data(), high.row - low.row + 1, cols};
  const std::vector<std::int32_t> regions = connected_regions(window, true);
  const auto region_of = [&](Pixel pixel) {
    return regions[(pixel.row - low.row) * cols + pixel.col - low.col];
  };
  return region_of(a) != 0 && region_of(a) == region_of(b);
}

namespace {

constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();

// Returns for each pixel the distance to the nearest off pixel in its column, kFar if there is
// none.
std::vector<std::int32_t> distances_in_columns(const Bitmap& bitmap) {
  const std::size_t rows = bitmap.rows;
  const std::size_t cols = bitmap.cols;
  std::vector<std::int32_t> distances(rows * cols);
  const auto farther = [](std::int32_t distance) { return distance == kFar ? kFar : distance + 1; };
  for (std::size_t i = 0; i < rows * cols; ++i) {
    const std::int32_t above = i < cols ? kFar : distances[i - cols];
    distances[i] = bitmap.pixels[i] == 0 ? 0 : farther(above);
  }
  for (std::size_t i = rows * cols; i-- > 0;) {
    if (i + cols < rows * cols) distances[i] = std::min(distances[i], farther(distances[i + cols]));
  }
  return distances;
}

// The squared distance from the pixels of a row to the nearest off pixel of a column.
struct Parabola {
  std::int64_t column, least;
  double from;  // the column from which on it is less than that of the columns to the left
};

}  // namespace

std::vector<float> distances_to_off(const Bitmap& bitmap) {
  const std::size_t cols = bitmap.cols;
  const std::vector<std::int32_t> in_columns = distances_in_columns(bitmap);
  std::vector<float> distances(in_columns.size(), std::numeric_limits<float>::infinity());
  std::vector<Parabola> lowest;
  for (std::size_t start = 0; start < in_columns.size(); start += cols) {
    lowest.clear();
    for (std::size_t x = 0; x < cols; ++x) {
      if (in_columns[start + x] == kFar) continue;
      const std::int64_t distance = in_columns[start + x];
      Parabola added{static_cast<std::int64_t>(x), distance * distance,
                     -std::numeric_limits<double>::infinity()};
      while (!lowest.empty()) {
        // All numbers are integers that a double represents.
        const Parabola& last = lowest.back();
        const std::int64_t apart = added.column - last.column;
        const std::int64_t difference =
            added.least - last.least + apart * (added.column + last.column);
        added.from = static_cast<double>(difference) / static_cast<double>(2 * apart);
        if (added.from > last.from) break;
        lowest.pop_back();
        added.from = -std::numeric_limits<double>::infinity();
      }
      lowest.push_back(added);
    }
    if (lowest.empty()) continue;
    std::size_t i = 0;
    for (std::size_t x = 0; x < cols; ++x) {
      while (i + 1 < lowest.size() && lowest[i + 1].from < static_cast<double>(x)) ++i;
      const std::int64_t apart = static_cast<std::int64_t>(x) - lowest[i].column;
      distances[start + x] = std::sqrt(static_cast<float>(apart * apart + lowest[i].least));
    }
  }
  return distances;
}

namespace {

struct Offset {
  double x, y;
};

Offset between(const PixelCorner& from, const PixelCorner& to) {
  return {static_cast<double>(to.x) - from.x, static_cast<double>(to.y) - from.y};
}
double squared_length(const Offset& offset) { return offset.x * offset.x + offset.y * offset.y; }
double cross(const Offset& a, const Offset& b) { return a.x * b.y - a.y * b.x; }

// A loop whose indices continue at its start.
class Loop {
 public:
  explicit Loop(const std::vector<PixelCorner>& points) : points_(points) {}

  const PixelCorner& operator[](std::size_t index) const { return points_[index % points_.size()]; }

  // Returns the index of the first point with the greatest distance from a point.
  std::size_t farthest_from(std::size_t index) const {
    return farthest(index, index + points_.size(), [&](const PixelCorner& point) {
      return squared_length(between((*this)[index], point));
    });
  }
  // Returns the index of the first point between two others that is farthest from their line.
  std::size_t farthest_between(std::size_t first, std::size_t last) const {
    const Offset line = between((*this)[first], (*this)[last]);
    return farthest(first, last, [&](const PixelCorner& point) {
      return std::abs(cross(between((*this)[first], point), line));
    });
  }

 private:
  template <typename Measure>
  std::size_t farthest(std::size_t first, std::size_t last, Measure&& measure) const {
    std::size_t found = first;
    double greatest = 0.0;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double distance = measure((*this)[i]);
      if (distance > greatest) {
        greatest = distance;
        found = i;
      }
    }
    return found;
  }

  const std::vector<PixelCorner>& points_;
};

// Removes points that are almost on the line between their neighbours. Of two such points in
// succession, the second one stays.
void remove_straight_corners(std::vector<PixelCorner>& points, double tolerance) {
  const std::size_t count = points.size();
  std::size_t remaining = count;
  std::size_t read = 0;
  std::size_t written = 0;
  const auto next = [&] { return points[read++ % count]; };
  PixelCorner before = points.back();
  PixelCorner corner = next();
  // The last corners are compared with the first ones that remain.
  for (std::size_t i = 0; i < count && remaining > 2; ++i) {
    const PixelCorner after = next();
    const Offset line = between(before, after);
    const Offset there = between(before, corner);
    const Offset onwards = between(corner, after);
    const double off_line = cross(there, line);
    if (off_line * off_line <= 0.5 * tolerance * tolerance * squared_length(line) && line.x != 0 &&
        line.y != 0 && there.x * onwards.x + there.y * onwards.y >= 0) {
      --remaining;
      ++i;
      before = after;
      corner = next();
    } else {
      before = corner;
      corner = after;
    }
    points[written++ % count] = before;
  }
  points.resize(remaining);
}

}  // namespace

std::vector<PixelCorner> simplified_loop(const std::vector<PixelCorner>& points, double tolerance) {
  if (points.empty()) return {};
  const Loop loop(points);
  // Two points that are far from each other divide the loop.
  const std::size_t count = points.size();
  const std::size_t first = loop.farthest_from(loop.farthest_from(0) % count) % count;
  const std::size_t opposite = loop.farthest_from(first);
  if (squared_length(between(loop[first], loop[opposite])) <= tolerance * tolerance) {
    return {loop[first]};
  }
  std::vector<PixelCorner> kept;
  std::vector<std::pair<std::size_t, std::size_t>> parts{{opposite, first + count},
                                                         {first, opposite}};
  while (!parts.empty()) {
    const auto [start, end] = parts.back();
    parts.pop_back();
    const std::size_t middle = loop.farthest_between(start, end);
    const Offset line = between(loop[start], loop[end]);
    const double off_line = cross(between(loop[start], loop[middle]), line);
    if (off_line * off_line <= tolerance * tolerance * squared_length(line)) {
      kept.push_back(loop[start]);
    } else {
      parts.emplace_back(middle, end);
      parts.emplace_back(start, middle);
    }
  }
  remove_straight_corners(kept, tolerance);
  return kept;
}

}  // namespace flatland
