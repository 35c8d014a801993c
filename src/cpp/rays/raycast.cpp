#include "rays/raycast.h"

#include <box2d/b2_fixture.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "rays/depth_scan.h"
#include "rays/ray_scene.h"
#include "rays/scene_view.h"
#include "world/contacts.h"
#include "world/shared_walls.h"

namespace flatland {
namespace {

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
    if (hit && fraction >= hit->fraction) return hit->fraction;
    hit = RayHit{fraction, point, normal, id_of(fixture), category};
    return fraction;
  }

  std::optional<RayHit> hit;

 private:
  RayMasks masks_;
};

std::optional<RayHit> closest(const Engines& engines, const b2Vec2& from, const b2Vec2& to,
                              RayMasks masks) {
  // Box2D aborts if the squared length of a ray is zero. Underflow can be the reason.
  if (!((to - from).LengthSquared() > 0.0F)) return std::nullopt;
  ClosestHit callback(masks);
  engines.for_each([&](const b2World& engine) { engine.RayCast(&callback, from, to); });
  return callback.hit;
}

}  // namespace

std::optional<RayHit> ray_cast(const Engines& engines, const b2Vec2& from, const b2Vec2& to,
                               std::uint16_t mask) {
  return closest(engines, from, to, {mask, kAnyCategory});
}

void cast_rays_reference(const Engines& engines, const ScanRequest& request,
                         const ScanResult& result) {
  const b2Vec2 from = request.pose.p;
  for (std::size_t i = 0; i < request.count; ++i) {
    const b2Vec2 end(request.ends[2 * i], request.ends[2 * i + 1]);
    const b2Vec2 to = b2Mul(request.pose, end);
    const auto hit = closest(engines, from, to, {request.mask, kAnyCategory});
    result.fractions[i] = hit ? hit->fraction : std::numeric_limits<float>::quiet_NaN();
    result.reflect[i] = false;
    if (!hit || request.reflect_mask == 0) continue;
    const auto reflection = closest(engines, from, to, {request.mask, request.reflect_mask});
    if (!reflection) continue;
    const float length = end.Length();
    const float gap = (reflection->fraction - hit->fraction) * length;
    result.reflect[i] = gap <= kDistanceTolerance + kFractionTolerance * length;
  }
}

void cast_rays(RayScene& scene, const BeamFan& fan, const ScanRequest& request,
               const ScanResult& result) {
  std::fill_n(result.fractions, request.count, std::numeric_limits<float>::quiet_NaN());
  std::fill_n(result.reflect, request.count, false);
  ScanBuffer buffer;
  DepthScan scan(fan, request.pose, buffer);
  const SceneView view(scene);
  view.draw(scan, {request.mask, kAnyCategory});
  for (std::size_t i = 0; i < fan.count(); ++i) {
    if (scan.fractions()[i] <= 1.0F) result.fractions[fan.order()[i]] = scan.fractions()[i];
  }
  if (request.reflect_mask != 0) {
    std::vector<float> limits;
    find_reflections(scan, view, fan, {request.mask, request.reflect_mask}, limits, result.reflect);
  }
}

}  // namespace flatland
