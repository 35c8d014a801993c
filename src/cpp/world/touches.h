// Collectors of contacts, for plugins that do not need a call at each contact.
#pragma once

#include <box2d/b2_collision.h>

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "world/slot_map.h"

namespace flatland {

struct ContactRow;

// A contact in a collector, with the impulses of the latest step in which the solver processed the
// contact.
struct Touch {
  std::uint64_t contact_id = 0;
  Id this_body = 0;
  Id other_body = 0;
  bool is_a = false;            // whether `this_body` is body A, from which the normal points away
  std::uint64_t solved_in = 0;  // number of the latest step with a call of the solver, 0 for none
  std::int64_t solver_calls = 0;  // number of calls in this step
  // The sums of the impulses of these calls, by point. The number of points can change between
  // calls.
  double normal_impulses[b2_maxManifoldPoints] = {};
  double tangent_impulses[b2_maxManifoldPoints] = {};
  // The members below belong to the last call; the points and the normal are those of a ContactRow.
  std::size_t point_count = 0;
  b2Vec2 points[b2_maxManifoldPoints] = {{0.0F, 0.0F}, {0.0F, 0.0F}};
  b2Vec2 normal{0.0F, 0.0F};
};

// The contacts of some bodies with other bodies.
struct TouchCollector {
  std::vector<Id> bodies;
  std::vector<Id> excluded;    // contacts of these bodies are ignored
  bool counts_sensors = true;  // whether contacts of sensors are collected
  bool counts_own = true;      // whether contacts between two bodies of `bodies` are collected
  bool was_touched = false;    // whether a contact began after the flag was cleared
  std::vector<Touch> touches;  // the current contacts, the oldest first
};

class TouchCollectors {
 public:
  // Adds a collector. `existing` are all contacts that touch now, of which the collector receives
  // the matching ones.
  Id add(const TouchCollector& collector, const std::vector<ContactRow>& existing);
  TouchCollector* find(Id id) { return collectors_.find(id); }
  void remove(Id id);
  // Excludes the ids that `others` have returned, see SlotMap.
  void exclude_ids_of(const TouchCollectors& others) {
    collectors_.exclude_ids_of(others.collectors_);
  }

  // Sets whether a model or a layer owns a body. Contacts of other bodies are ignored.
  void set_owned(Id body, bool is_owned);

  // Must be called for the events of contacts, in chronological order.
  void begin(const ContactRow& row);
  void end(std::uint64_t contact_id, Id body_a, Id body_b);
  void post_solve(const ContactRow& row, std::uint64_t step);
  // Returns whether any collector collects contacts of one of two bodies.
  bool concern(Id body_a, Id body_b) const {
    return by_body_.count(body_a) != 0 || by_body_.count(body_b) != 0;
  }

 private:
  // Calls visit(collector) once for each collector of contacts of one of two bodies.
  template <typename Visit>
  void for_each(Id body_a, Id body_b, Visit&& visit);
  void begin_in(TouchCollector& collector, const ContactRow& row);

  SlotMap<TouchCollector, IdKind::kTouches> collectors_;
  std::unordered_map<Id, std::vector<Id>> by_body_;
  IdSet owned_;
};

}  // namespace flatland
