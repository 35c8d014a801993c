// One scan as a one-dimensional depth buffer: how far each ray of a fan gets.
//
// Edges and shapes are drawn into the rays they cover, near ones first as far as that is known;
// boxes that lie behind what all their rays have met already are left out. Each ray is tested
// against a candidate with the arithmetic of Box2D's own RayCast functions, in the same order and
// in single precision, so that the fractions are those of b2World::RayCast. Only where two edges
// meet is it stricter: a ray crosses an edge when the edge's ends lie on different sides of it,
// which no rounding can make false for both of two edges with a common end.
#pragma once

#include <box2d/b2_collision.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_math.h>

#include <cstdint>
#include <vector>

#include "rays/beam_fan.h"
#include "rays/edge_tree.h"

namespace flatland {

// What a fixture's categories must have for a ray to be stopped by it: one of each mask.
struct RayMasks {
  std::uint16_t mask;
  std::uint16_t also;

  bool pass(std::uint16_t category_bits) const {
    return (category_bits & mask) != 0 && (category_bits & also) != 0;
  }
};

class DepthScan {
 public:
  // The fan must outlive the scan. Rays start out free over their whole length.
  DepthScan(const BeamFan& fan, const b2Transform& pose);

  // Shortens the rays, by index as sorted: nothing at or beyond a fraction is seen from now on.
  void set_limits(const std::vector<float>& fractions);

  // Draws the edges of a tree whose frame is at `body`.
  void draw(const EdgeTree& tree, const b2Transform& body, RayMasks masks);
  // Draws circles and polygons.
  void draw(const std::vector<b2Fixture*>& solids, RayMasks masks);

  // Fraction that each ray got, by index as sorted; above 1 for a ray that met nothing.
  const std::vector<float>& fractions() const { return fractions_; }

  // A fraction that is not seen any more as a hit, the initial one.
  static float free_fraction();

 private:
  friend struct DepthScanKernel;

  const BeamFan& fan_;
  b2Transform pose_;
  std::vector<float> end_x_, end_y_;  // world frame
  // Direction and length of each ray in the frame of what is drawn now.
  std::vector<float> d_x_, d_y_;
  b2Transform frame_;
  bool has_frame_ = false;
  std::vector<float> fractions_;
  std::vector<float> reach_;  // how far each ray still gets [m]
};

}  // namespace flatland
