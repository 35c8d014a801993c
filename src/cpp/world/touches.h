// Collectors of contacts, for plugins that need not be called at each contact.
#pragma once

#include <box2d/b2_collision.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "world/slot_map.h"

class b2World;

namespace flatland {

struct ContactRow;

// A contact that a collector has, and what the solver did to it in the latest step in which it did.
struct Touch {
  std::uint64_t contact_id = 0;
  Id this_body = 0;
  Id other_body = 0;
  bool is_a = false;            // whether `this_body` is body A, from which the normal points away
  std::uint64_t solved_in = 0;  // number of that step, 0 for none
  std::int64_t solver_calls = 0;  // in that step
  // Sums over these calls, by point; a call contributes nothing to points that it did not have.
  double normal_impulses[b2_maxManifoldPoints] = {};
  double tangent_impulses[b2_maxManifoldPoints] = {};
  // Of the last call.
  std::size_t point_count = 0;
  float points[b2_maxManifoldPoints][2] = {};
  float normal[2] = {};
};

// The contacts of some bodies with other bodies.
struct TouchCollector {
  std::vector<Id> bodies;
  std::vector<Id> excluded;    // contacts of these bodies are ignored
  bool counts_sensors = true;  // whether contacts of sensors are collected
  bool counts_own = true;      // whether contacts between two of the bodies are collected
  bool ends_runs = false;      // whether a run of steps ends after a step with contacts
  bool was_touched = false;    // since the last call of `clear`
  std::vector<Touch> touches;  // that exist now, the oldest first
};

class TouchCollectors {
 public:
  // Adds a collector; those of `existing`, contacts that touch now, are collected.
  Id add(const TouchCollector& collector, const std::vector<ContactRow>& existing);
  TouchCollector* find(Id id) { return collectors_.find(id); }
  void remove(Id id);
  // Excludes the ids that others have returned, see SlotMap.
  void exclude_ids_of(const TouchCollectors& others) {
    collectors_.exclude_ids_of(others.collectors_);
  }
  bool empty() const { return collectors_.size() == 0; }
  // Whether any collector that ends runs has contacts.
  bool end_run() const { return ending_ > 0; }
  // Whether there is such a collector.
  bool can_end_run() const { return ending_collectors_ > 0; }
  void set_ends_runs(TouchCollector& collector, bool ends_runs);

  // Contacts of bodies that are not owned by a model or a layer are ignored.
  void set_owned(Id body, bool is_owned);

  // The events of contacts, in order.
  void begin(const ContactRow& row);
  void end(std::uint64_t contact_id, Id body_a, Id body_b);
  void post_solve(const ContactRow& row, std::uint64_t step);
  // Whether any collector has contacts of one of the bodies.
  bool concern(Id body_a, Id body_b) const {
    return by_body_.count(body_a) != 0 || by_body_.count(body_b) != 0;
  }

 private:
  // Calls visit(collector) once for each collector that has contacts of one of the bodies.
  template <typename Visit>
  void for_each(Id body_a, Id body_b, Visit&& visit);
  void begin_in(TouchCollector& collector, const ContactRow& row);

  SlotMap<TouchCollector, IdKind::kTouches> collectors_;
  std::unordered_map<Id, std::vector<Id>> by_body_;
  std::unordered_map<Id, bool> owned_;
  std::int64_t ending_ = 0;  // contacts of collectors that end runs
  std::int64_t ending_collectors_ = 0;
};

}  // namespace flatland
