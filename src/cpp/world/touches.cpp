#include "world/touches.h"

#include <algorithm>

#include "world/contacts.h"

namespace flatland {
namespace {

bool contains(const std::vector<Id>& ids, Id id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

}  // namespace

template <typename Visit>
void TouchCollectors::for_each(Id body_a, Id body_b, Visit&& visit) {
  const auto of_a = by_body_.find(body_a);
  if (of_a != by_body_.end()) {
    for (const Id id : of_a->second) visit(*collectors_.find(id));
  }
  const auto of_b = by_body_.find(body_b);
  if (of_b == by_body_.end()) return;
  for (const Id id : of_b->second) {
    if (of_a == by_body_.end() || !contains(of_a->second, id)) visit(*collectors_.find(id));
  }
}

Id TouchCollectors::add(const TouchCollector& collector, const std::vector<ContactRow>& existing) {
  const Id id = collectors_.insert(collector);
  for (const Id body : collector.bodies) by_body_[body].push_back(id);
  TouchCollector& added = *collectors_.find(id);
  for (const ContactRow& row : existing) {
    if (contains(added.bodies, row.body_a) || contains(added.bodies, row.body_b)) {
      begin_in(added, row);
    }
  }
  return id;
}

void TouchCollectors::remove(Id id) {
  TouchCollector* collector = collectors_.find(id);
  if (collector == nullptr) return;
  for (const Id body : collector->bodies) {
    const auto of_body = by_body_.find(body);
    if (of_body == by_body_.end()) continue;
    std::vector<Id>& ids = of_body->second;
    ids.erase(std::remove(ids.begin(), ids.end(), id), ids.end());
    if (ids.empty()) by_body_.erase(of_body);
  }
  collectors_.erase(id);
}

void TouchCollectors::set_owned(Id body, bool is_owned) {
  if (is_owned) {
    owned_.insert(body);
  } else {
    owned_.erase(body);
  }
}

void TouchCollectors::begin(const ContactRow& row) {
  for_each(row.body_a, row.body_b, [&](TouchCollector& collector) { begin_in(collector, row); });
}

void TouchCollectors::begin_in(TouchCollector& collector, const ContactRow& row) {
  if (!owned_.contains(row.body_a) || !owned_.contains(row.body_b)) return;
  if (row.is_sensor && !collector.counts_sensors) return;
  if (contains(collector.excluded, row.body_a) || contains(collector.excluded, row.body_b)) return;
  const bool is_a = contains(collector.bodies, row.body_a);
  if (!collector.counts_own && is_a && contains(collector.bodies, row.body_b)) return;
  Touch touch;
  touch.contact_id = row.contact_id;
  touch.this_body = is_a ? row.body_a : row.body_b;
  touch.other_body = is_a ? row.body_b : row.body_a;
  touch.is_a = is_a;
  collector.touches.push_back(touch);
  collector.was_touched = true;
}

void TouchCollectors::end(std::uint64_t contact_id, Id body_a, Id body_b) {
  for_each(body_a, body_b, [&](TouchCollector& collector) {
    std::vector<Touch>& touches = collector.touches;
    const auto found = std::find_if(touches.begin(), touches.end(), [&](const Touch& touch) {
      return touch.contact_id == contact_id;
    });
    if (found != touches.end()) touches.erase(found);
  });
}

void TouchCollectors::post_solve(const ContactRow& row, std::uint64_t step) {
  for_each(row.body_a, row.body_b, [&](TouchCollector& collector) {
    for (Touch& touch : collector.touches) {
      if (touch.contact_id != row.contact_id) continue;
      if (touch.solved_in != step) {
        touch.solved_in = step;
        touch.solver_calls = 0;
        std::fill_n(touch.normal_impulses, b2_maxManifoldPoints, 0.0);
        std::fill_n(touch.tangent_impulses, b2_maxManifoldPoints, 0.0);
      }
      ++touch.solver_calls;
      touch.point_count = row.point_count;
      for (std::size_t i = 0; i < row.point_count; ++i) {
        touch.normal_impulses[i] += static_cast<double>(row.normal_impulses[i]);
        touch.tangent_impulses[i] += static_cast<double>(row.tangent_impulses[i]);
        touch.points[i] = row.points[i];
      }
      touch.normal = row.normal;
      return;
    }
  });
}

}  // namespace flatland
