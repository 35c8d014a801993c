// What happened between fixtures during a step, as plain rows.
#pragma once

#include <box2d/b2_world_callbacks.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "world/slot_map.h"
#include "world/step_guard.h"

class b2World;

namespace flatland {

enum class ContactKind : std::uint8_t { kBegin = 0, kEnd = 1, kPostSolve = 2, kTouching = 3 };

// One contact at one moment, in the world frame. The normal points from A to B; it is zero where
// there are no points, which is so for sensors and after the shapes came apart.
struct ContactRow {
  Id fixture_a, fixture_b, body_a, body_b;
  std::uint64_t contact_id;  // unique for as long as the two fixtures touch
  float points[b2_maxManifoldPoints][2];
  float normal[2];
  float normal_impulses[b2_maxManifoldPoints];
  float tangent_impulses[b2_maxManifoldPoints];
  ContactKind kind;
  std::uint8_t point_count;
  bool is_sensor;
};

// Ids that a body or fixture carries in its user data.
Id id_of(const b2Body* body);
Id id_of(const b2Fixture* fixture);

// May change contacts that are about to be solved. Called inside b2World::Step, so it must not
// throw, nor create, destroy or move anything.
class PreSolveHook {
 public:
  virtual ~PreSolveHook() = default;
  // Whether this body's contacts are to be shown.
  virtual bool wants(Id body) const noexcept = 0;
  virtual void pre_solve(b2Contact* contact, const ContactRow& row,
                         const b2Manifold& old_manifold) noexcept = 0;
};

// Listens to Box2D. Never throws: an exception out of b2World::Step would leave the world locked
// for ever. What could not be recorded for want of memory is reported by `take_failure`.
class ContactRecorder final : public b2ContactListener {
 public:
  // Rows are written only while this is set; contacts keep their ids all the time.
  bool recording = false;
  // Not owned; set for the length of a step.
  PreSolveHook* hook = nullptr;
  StepGuard guard;

  void BeginContact(b2Contact* contact) override;
  void EndContact(b2Contact* contact) override;
  void PreSolve(b2Contact* contact, const b2Manifold* old_manifold) override;
  void PostSolve(b2Contact* contact, const b2ContactImpulse* impulse) override;

  // The rows since the last call, in order of time.
  std::vector<ContactRow> take_rows();
  // True once after rows were lost.
  bool take_failure();

  // All contacts that touch now.
  std::vector<ContactRow> touching(const b2World& world) const;

 private:
  ContactRow make_row(b2Contact* contact, ContactKind kind) const;

  std::vector<ContactRow> rows_;
  std::unordered_map<const b2Contact*, std::uint64_t> ids_;
  std::uint64_t last_id_ = 0;
  bool failed_ = false;
};

}  // namespace flatland
