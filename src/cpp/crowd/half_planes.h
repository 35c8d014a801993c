// Linear programs in the plane, for velocities that satisfy constraints.
#pragma once

#include <cstddef>
#include <vector>

#include "vec.h"

namespace flatland::crowd {

// The vectors v with dot(normal, v) >= offset; the normal has length 1.
struct HalfPlane {
  Vec normal;
  double offset = 0.0;
};

// Returns the point nearest to `preferred` in the intersection of all half-planes and of the disc
// with a radius around the origin. If the intersection is empty, returns a point of the disc that
// minimizes the greatest violation of the half-planes with an index of at least `hard`, and
// satisfies the half-planes with a lower index if possible.
//
// Source: the incremental linear programs of M. de Berg et al., "Computational Geometry" (2008),
// chapter 4, as used by J. van den Berg, S. Guy, M. Lin and D. Manocha, "Reciprocal n-body
// collision avoidance", Robotics Research (2011), section 5.
Vec nearest_point(const std::vector<HalfPlane>& planes, std::size_t hard, double radius,
                  Vec preferred);

}  // namespace flatland::crowd
