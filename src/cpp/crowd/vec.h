// Vectors in the plane, in double precision.
#pragma once

#include <cmath>

namespace flatland::crowd {

struct Vec {
  double x = 0.0;
  double y = 0.0;

  Vec& operator+=(Vec other) { return *this = {x + other.x, y + other.y}; }
  Vec& operator-=(Vec other) { return *this = {x - other.x, y - other.y}; }
};

inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y}; }
inline Vec operator-(Vec a) { return {-a.x, -a.y}; }
inline Vec operator*(double k, Vec a) { return {k * a.x, k * a.y}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y; }
inline double cross(Vec a, Vec b) { return a.x * b.y - a.y * b.x; }
inline double square(Vec a) { return dot(a, a); }
inline double length(Vec a) { return std::sqrt(square(a)); }
// The vector turned by 90 degrees counter-clockwise.
inline Vec left_of(Vec a) { return {-a.y, a.x}; }
// The unit vector of a direction; `otherwise` if the vector is (almost) zero.
inline Vec unit(Vec a, Vec otherwise = {}) {
  const double l = length(a);
  return l > 1e-12 ? (1.0 / l) * a : otherwise;
}
// The vector, shortened to a length if it is longer.
inline Vec limited(Vec a, double most) {
  const double l = length(a);
  return l > most ? (most / l) * a : a;
}

}  // namespace flatland::crowd
