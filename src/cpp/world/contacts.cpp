#include "world/contacts.h"

#include <box2d/b2_body.h>
#include <box2d/b2_contact.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_joint.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace flatland {

static_assert(sizeof(uintptr_t) >= sizeof(Id), "ids must fit into the user data of Box2D");

// In Box2D 2.4, user data can only be accessed through non-const objects.
Id id_of(const b2Body* body) { return const_cast<b2Body*>(body)->GetUserData().pointer; }
Id id_of(const b2Fixture* fixture) {
  return const_cast<b2Fixture*>(fixture)->GetUserData().pointer;
}
Id id_of(const b2Joint* joint) { return const_cast<b2Joint*>(joint)->GetUserData().pointer; }

namespace {

Id body_a_of(const b2Contact* contact) {
  return id_of(const_cast<b2Contact*>(contact)->GetFixtureA()->GetBody());
}

Id body_b_of(const b2Contact* contact) {
  return id_of(const_cast<b2Contact*>(contact)->GetFixtureB()->GetBody());
}

}  // namespace

void ContactRecorder::record_body(Id body, std::uint8_t kinds) {
  const std::uint32_t slot = slot_of(body);
  if (slot >= kinds_of_body_.size()) {
    if (kinds == 0) return;
    kinds_of_body_.resize(slot + 1);
  }
  kinds_of_body_[slot] = kinds;
}

bool ContactRecorder::is_recording() const {
  return recording || kinds_of_all_ != 0 ||
         std::any_of(kinds_of_body_.begin(), kinds_of_body_.end(),
                     [](std::uint8_t kinds) { return kinds != 0; });
}

bool ContactRecorder::records(const b2Contact* contact, ContactKind kind) const {
  if (recording) return true;
  const auto kinds = [this](Id body) -> int {
    const std::uint32_t slot = slot_of(body);
    return slot < kinds_of_body_.size() ? kinds_of_body_[slot] : 0;
  };
  const int recorded = kinds_of_all_ | kinds(body_a_of(contact)) | kinds(body_b_of(contact));
  return (recorded >> static_cast<int>(kind) & 1) != 0;
}

void ContactRecorder::BeginContact(b2Contact* contact) {
  try {
    ids_[contact] = ++last_id_;
    const bool is_collected = touches.concern(body_a_of(contact), body_b_of(contact));
    const bool is_recorded = records(contact, ContactKind::kBegin);
    if (!is_collected && !is_recorded) return;
    const ContactRow row = make_row(contact, ContactKind::kBegin);
    if (is_collected) touches.begin(row);
    if (is_recorded) rows_.push_back(row);
  } catch (const std::exception&) {
    failed_ = true;
  }
}

void ContactRecorder::EndContact(b2Contact* contact) {
  try {
    if (records(contact, ContactKind::kEnd)) {
      rows_.push_back(make_row(contact, ContactKind::kEnd));
    }
  } catch (const std::exception&) {
    failed_ = true;
  }
  const auto known = ids_.find(contact);
  if (known == ids_.end()) return;
  touches.end(known->second, body_a_of(contact), body_b_of(contact));
  ids_.erase(known);
}

void ContactRecorder::PreSolve(b2Contact* contact, const b2Manifold* old_manifold) {
  const bool is_wanted =
      hook != nullptr && (hook->wants(id_of(contact->GetFixtureA()->GetBody())) ||
                          hook->wants(id_of(contact->GetFixtureB()->GetBody())));
  if (is_wanted) {
    hook->pre_solve(contact, make_row(contact, ContactKind::kTouching), *old_manifold);
  }
  guard.pre_solve(contact);
}

void ContactRecorder::PostSolve(b2Contact* contact, const b2ContactImpulse* impulse) {
  guard.post_solve(contact);
  const bool is_collected = touches.concern(body_a_of(contact), body_b_of(contact));
  const bool is_recorded = records(contact, ContactKind::kPostSolve);
  if (!is_collected && !is_recorded) return;
  try {
    ContactRow row = make_row(contact, ContactKind::kPostSolve);
    std::copy_n(impulse->normalImpulses, impulse->count, row.normal_impulses);
    std::copy_n(impulse->tangentImpulses, impulse->count, row.tangent_impulses);
    if (is_collected) touches.post_solve(row, step_);
    if (is_recorded) rows_.push_back(row);
  } catch (const std::exception&) {
    failed_ = true;
  }
}

std::vector<ContactRow> ContactRecorder::take_rows() { return std::exchange(rows_, {}); }

bool ContactRecorder::take_failure() { return std::exchange(failed_, false); }

void ContactRecorder::replace_contacts(
    const std::unordered_map<const b2Contact*, const b2Contact*>& copies) {
  std::unordered_map<const b2Contact*, std::uint64_t> ids;
  for (const auto& [contact, id] : ids_) ids[copies.at(contact)] = id;
  ids_ = std::move(ids);
}

std::vector<ContactRow> ContactRecorder::touching(const b2World& world) const {
  std::vector<ContactRow> rows;
  // make_row only reads the contact, but the accessors of b2Contact are not const-correct.
  auto* contact = const_cast<b2Contact*>(world.GetContactList());
  for (; contact != nullptr; contact = contact->GetNext()) {
    if (contact->IsTouching()) rows.push_back(make_row(contact, ContactKind::kTouching));
  }
  return rows;
}

ContactRow ContactRecorder::make_row(b2Contact* contact, ContactKind kind) const {
  const b2Fixture* fixture_a = contact->GetFixtureA();
  const b2Fixture* fixture_b = contact->GetFixtureB();
  ContactRow row{};
  row.kind = kind;
  row.fixture_a = id_of(fixture_a);
  row.fixture_b = id_of(fixture_b);
  row.body_a = id_of(fixture_a->GetBody());
  row.body_b = id_of(fixture_b->GetBody());
  row.is_sensor = fixture_a->IsSensor() || fixture_b->IsSensor();
  const auto known = ids_.find(contact);
  row.contact_id = known == ids_.end() ? 0 : known->second;
  const int32 count = contact->GetManifold()->pointCount;
  row.point_count = static_cast<std::uint8_t>(count);
  if (count > 0) {
    b2WorldManifold manifold;
    contact->GetWorldManifold(&manifold);
    row.normal = manifold.normal;
    std::copy_n(manifold.points, count, row.points);
  }
  return row;
}

}  // namespace flatland
