// Vectors in the plane, in double precision. A value of Box2D, and what rays are computed from, is
// a b2Vec2 in single precision; a pose or a velocity with its rotation is a Triple
// (world/triple.h).
#pragma once

#include <box2d/b2_math.h>

#include <cmath>

namespace flatland {

struct Vec {
  double x = 0.0;
  double y = 0.0;

  Vec& operator+=(Vec other) { return *this = {x + other.x, y + other.y}; }
  Vec& operator-=(Vec other) { return *this = {x - other.x, y - other.y}; }
};

inline Vec to_vec(const b2Vec2& v) { return {static_cast<double>(v.x), static_cast<double>(v.y)}; }

inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y}; }
inline Vec operator-(Vec a) { return {-a.x, -a.y}; }
inline Vec operator*(double k, Vec a) { return {k * a.x, k * a.y}; }
inline Vec operator/(Vec a, double k) { return {a.x / k, a.y / k}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y; }
inline double cross(Vec a, Vec b) { return a.x * b.y - a.y * b.x; }
inline double square(Vec a) { return dot(a, a); }
inline double length(Vec a) { return std::sqrt(square(a)); }
// Returns a vector turned by 90 degrees counter-clockwise.
inline Vec left_of(Vec a) { return {-a.y, a.x}; }
// Returns the unit vector of a direction, or `otherwise` if the vector is shorter than 1e-12.
inline Vec unit(Vec a, Vec otherwise = {}) {
  const double l = length(a);
  return l > 1e-12 ? (1.0 / l) * a : otherwise;
}
// Returns a vector that is shortened to the length `most` if it is longer.
inline Vec limited(Vec a, double most) {
  const double l = length(a);
  return l > most ? (most / l) * a : a;
}

}  // namespace flatland
