#include "rays/raycast.h"

#include <box2d/b2_fixture.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "rays/depth_scan.h"
#include "rays/ray_scene.h"
#include "world/contacts.h"

namespace flatland {
namespace {

constexpr std::uint16_t kAnyCategory = 0xFFFF;

class ClosestHit final : public b2RayCastCallback {
 public:
  explicit ClosestHit(RayMasks masks) : masks_(masks) {}

  float ReportFixture(b2Fixture* fixture, const b2Vec2& point, const b2Vec2& normal,
                      float fraction) override {
    constexpr float kIgnore = -1.0F;
    const std::uint16_t category = fixture->GetFilterData().categoryBits;
    if (fixture->IsSensor() || !masks_.pass(category)) return kIgnore;
    // An overflow in the solver can make the pose of a body not finite.
    if (std::isnan(fraction)) return kIgnore;
    hit = RayHit{fraction, point, normal, id_of(fixture), category};
    return fraction;
  }

  std::optional<RayHit> hit;

 private:
  RayMasks masks_;
};

std::optional<RayHit> closest(const b2World& world, const b2Vec2& from, const b2Vec2& to,
                              RayMasks masks) {
  // Box2D aborts if the squared length of a ray is zero, which can be due to underflow.
  if (!((to - from).LengthSquared() > 0.0F)) return std::nullopt;
  ClosestHit callback(masks);
  world.RayCast(&callback, from, to);
  return callback.hit;
}

}  // namespace

std::optional<RayHit> ray_cast(const b2World& world, const b2Vec2& from, const b2Vec2& to,
                               std::uint16_t mask) {
  return closest(world, from, to, {mask, kAnyCategory});
}

void cast_rays_reference(const b2World& world, const ScanRequest& request,
                         const ScanResult& result) {
  const b2Vec2 from = request.pose.p;
  for (std::size_t i = 0; i < request.count; ++i) {
    const b2Vec2 end(request.ends[2 * i], request.ends[2 * i + 1]);
    const b2Vec2 to = b2Mul(request.pose, end);
    const auto hit = closest(world, from, to, {request.mask, kAnyCategory});
    result.fractions[i] = hit ? hit->fraction : std::numeric_limits<float>::quiet_NaN();
    result.reflect[i] = false;
    if (!hit || request.reflect_mask == 0) continue;
    const auto reflection = closest(world, from, to, {request.mask, request.reflect_mask});
    if (!reflection) continue;
    const float length = end.Length();
    const float gap = (reflection->fraction - hit->fraction) * length;
    result.reflect[i] = gap <= kDistanceTolerance + kFractionTolerance * length;
  }
}

namespace {

void draw_all(DepthScan& scan, RayScene& scene, RayMasks masks) {
  for (const EdgeGroup& edges : scene.edge_groups()) {
    scan.draw(*edges.tree, edges.bodies.front()->GetTransform(), masks);
  }
  scan.draw(scene.solids(), masks);
}

// Casts the rays again at the reflecting fixtures only, up to the distances of the nearest hits.
void find_reflections(DepthScan& scan, const BeamFan& fan, RayScene& scene,
                      const ScanRequest& request, bool* reflect) {
  float* fractions = scan.fractions();
  std::vector<float> limits(fan.count());
  for (std::size_t i = 0; i < fan.count(); ++i) {
    const bool is_hit = fractions[i] <= 1.0F;
    const float limit = fractions[i] + kFractionTolerance + kDistanceTolerance / fan.length()[i];
    fractions[i] = limits[i] = is_hit ? limit : -1.0F;
  }
  draw_all(scan, scene, {request.mask, request.reflect_mask});
  for (std::size_t i = 0; i < fan.count(); ++i) {
    reflect[fan.order()[i]] = fractions[i] < limits[i];
  }
}

}  // namespace

void cast_rays(RayScene& scene, const ScanRequest& request, const ScanResult& result) {
  std::fill_n(result.fractions, request.count, std::numeric_limits<float>::quiet_NaN());
  std::fill_n(result.reflect, request.count, false);
  const std::shared_ptr<const BeamFan> fan = scene.fans().get(request.ends, request.count);
  ScanBuffer buffer;
  DepthScan scan(*fan, request.pose, buffer);
  draw_all(scan, scene, {request.mask, kAnyCategory});
  for (std::size_t i = 0; i < fan->count(); ++i) {
    if (scan.fractions()[i] <= 1.0F) result.fractions[fan->order()[i]] = scan.fractions()[i];
  }
  if (request.reflect_mask != 0) {
    find_reflections(scan, *fan, scene, request, result.reflect);
  }
}

}  // namespace flatland
