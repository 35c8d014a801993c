// Contacts and contact events as plain rows.
#pragma once

#include <box2d/b2_world_callbacks.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "world/slot_map.h"
#include "world/step_guard.h"
#include "world/touches.h"

class b2Joint;
class b2World;

namespace flatland {

enum class ContactKind : std::uint8_t { kBegin = 0, kEnd = 1, kPostSolve = 2, kTouching = 3 };

// State of a contact at one moment, in the world frame. The normal points from A to B. Contacts of
// sensors and of shapes that no longer touch have no points and a zero normal.
struct ContactRow {
  Id fixture_a, fixture_b, body_a, body_b;
  std::uint64_t contact_id;  // does not change while the two fixtures touch
  b2Vec2 points[b2_maxManifoldPoints] = {{0.0F, 0.0F}, {0.0F, 0.0F}};
  b2Vec2 normal{0.0F, 0.0F};
  float normal_impulses[b2_maxManifoldPoints];
  float tangent_impulses[b2_maxManifoldPoints];
  ContactKind kind;
  std::uint8_t point_count;
  bool is_sensor;
};

// Return the id stored in the user data of an object.
Id id_of(const b2Body* body);
Id id_of(const b2Fixture* fixture);
Id id_of(const b2Joint* joint);

// Interface for changing contacts before they are solved. It is called within b2World::Step, so it
// must not throw, nor create, destroy or move objects.
class PreSolveHook {
 public:
  virtual ~PreSolveHook() = default;
  // Returns whether `pre_solve` must be called for the contacts of a body.
  virtual bool wants(Id body) const noexcept = 0;
  virtual void pre_solve(b2Contact* contact, const ContactRow& row,
                         const b2Manifold& old_manifold) noexcept = 0;
};

// Contact listener that records contact events. An exception out of b2World::Step would leave the
// world locked. The listener therefore throws no exceptions; `take_failure` reports a lack of
// memory.
class ContactRecorder final : public b2ContactListener {
 public:
  // Whether all events are recorded. Contacts have ids even if they are not recorded.
  bool recording = false;
  // Collectors of contacts, independent of the recorded events.
  TouchCollectors touches;
  // The recorder does not own the hook, which is set only during a step.
  PreSolveHook* hook = nullptr;
  StepGuard guard;

  void BeginContact(b2Contact* contact) override;
  void EndContact(b2Contact* contact) override;
  void PreSolve(b2Contact* contact, const b2Manifold* old_manifold) override;
  void PostSolve(b2Contact* contact, const b2ContactImpulse* impulse) override;

  // Sets the kinds of events that are recorded, of one body or of all bodies. The kinds are bits
  // 1 << kind.
  void record_body(Id body, std::uint8_t kinds);
  void record_all(std::uint8_t kinds) { kinds_of_all_ = kinds; }
  // Returns whether any events are recorded.
  bool is_recording() const;
  // Must be called before each physics step.
  void begin_step() { ++step_; }
  // Returns the number of physics steps so far.
  std::uint64_t step() const { return step_; }

  // Returns the events since the last call, in chronological order.
  std::vector<ContactRow> take_rows();
  bool has_rows() const { return !rows_.empty(); }
  // Returns whether events were lost for lack of memory since the last call.
  bool take_failure();

  // Replaces the contacts that have ids by their copies; for the copy of a recorder.
  void replace_contacts(const std::unordered_map<const b2Contact*, const b2Contact*>& copies);

  // Returns the contacts of all fixtures that currently touch.
  std::vector<ContactRow> touching(const b2World& world) const;

 private:
  ContactRow make_row(b2Contact* contact, ContactKind kind) const;
  bool records(const b2Contact* contact, ContactKind kind) const;

  std::vector<ContactRow> rows_;
  std::uint8_t kinds_of_all_ = 0;
  std::vector<std::uint8_t> kinds_of_body_;  // by slot of the id of a body
  std::uint64_t step_ = 0;
  std::unordered_map<const b2Contact*, std::uint64_t> ids_;
  std::uint64_t last_id_ = 0;
  bool failed_ = false;
};

}  // namespace flatland
