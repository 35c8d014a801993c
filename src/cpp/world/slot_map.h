// A container whose ids consist of a slot and a generation, which counts the earlier uses of the
// slot.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "prefetch.h"

namespace flatland {

// 4 bits of kind, 28 bits of generation and 32 bits of slot. Kinds are from 1 to 7, so that ids of
// different kinds differ, no id is 0, and ids are positive as signed integers.
using Id = std::uint64_t;

enum class IdKind : std::uint64_t {
  kBody = 1,
  kFixture = 2,
  kJoint = 3,
  kController = 4,
  kCallback = 5,
  kTouches = 6,
  kCrowd = 7
};

// Returns the part of an id that identifies an object among those of its kind that exist.
inline std::uint32_t slot_of(Id id) { return static_cast<std::uint32_t>(id); }

// Values by id. The id of an erased value is never valid again, even if its slot is reused.
template <typename Value, IdKind kKind>
class SlotMap {
 public:
  Id insert(Value value) {
    std::uint32_t slot;
    if (free_.empty()) {
      slot = static_cast<std::uint32_t>(slots_.size());
      slots_.push_back({std::move(value), 0, 1});
    } else {
      slot = free_.back();
      free_.pop_back();
      slots_[slot].value = std::move(value);
      slots_[slot].generation = slots_[slot].uses++;
    }
    ++size_;
    return make_id(slot);
  }

  // Returns the value, or null if the id is unknown or its value was erased.
  Value* find(Id id) {
    const std::uint32_t slot = slot_of(id);
    if (slot >= slots_.size() || !slots_[slot].is_used() || make_id(slot) != id) return nullptr;
    return &slots_[slot].value;
  }
  const Value* find(Id id) const { return const_cast<SlotMap*>(this)->find(id); }

  // Returns the value in a slot, or null if the slot is free.
  const Value* at_slot(std::uint32_t slot) const {
    return slot < slots_.size() && slots_[slot].is_used() ? &slots_[slot].value : nullptr;
  }

  void erase(Id id) {
    if (find(id) == nullptr) return;
    const std::uint32_t slot = slot_of(id);
    slots_[slot].value = Value{};
    slots_[slot].generation = kUnused;
    --size_;
    if (slots_[slot].is_reusable()) free_.push_back(slot);
  }

  // Calls visit(id, value) for each value in order of slots.
  template <typename Visit>
  void for_each(Visit&& visit) {
    for (std::uint32_t slot = 0; slot < slots_.size(); ++slot) {
      if (slots_[slot].is_used()) visit(make_id(slot), slots_[slot].value);
    }
  }

  void prefetch() const { flatland::prefetch(slots_); }
  void reserve(std::size_t more) { slots_.reserve(slots_.size() + more); }
  std::size_t size() const { return size_; }

  void clear() {
    slots_.clear();
    free_.clear();
    size_ = 0;
  }

  // Excludes the ids that `other` has returned, unless they belong to values of this map, from
  // those that `insert` returns. The slots that `insert` uses are the same as without this call,
  // as long as no slot is used up.
  void exclude_ids_of(const SlotMap& other) {
    const std::size_t count = slots_.size();
    for (std::size_t slot = 0; slot < other.slots_.size(); ++slot) {
      if (slot >= count) slots_.push_back({Value{}, kUnused, 0});
      slots_[slot].uses = std::max(slots_[slot].uses, other.slots_[slot].uses);
    }
    // Slots are taken from the end, new ones after all others and in ascending order.
    std::vector<std::uint32_t> free;
    for (std::size_t slot = slots_.size(); slot-- > count;) {
      free.push_back(static_cast<std::uint32_t>(slot));
    }
    free.insert(free.end(), free_.begin(), free_.end());
    const auto is_used_up = [this](std::uint32_t slot) { return !slots_[slot].is_reusable(); };
    free.erase(std::remove_if(free.begin(), free.end(), is_used_up), free.end());
    free_ = std::move(free);
  }

 private:
  static constexpr std::uint32_t kMostUses = 1U << 28U;
  static constexpr std::uint32_t kUnused = kMostUses;

  struct Slot {
    Value value;
    std::uint32_t generation;  // of the value, or kUnused
    std::uint32_t uses;        // the next generation

    bool is_used() const { return generation != kUnused; }
    bool is_reusable() const { return uses < kMostUses; }
  };

  Id make_id(std::uint32_t slot) const {
    return static_cast<Id>(kKind) << 60U | static_cast<Id>(slots_[slot].generation) << 32U | slot;
  }

  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::size_t size_ = 0;
};

// Ids of one kind, of objects that exist at the same time.
class IdSet {
 public:
  void insert(Id id) {
    if (slot_of(id) >= ids_.size()) ids_.resize(std::size_t{slot_of(id)} + 1);
    ids_[slot_of(id)] = id;
  }
  void erase(Id id) {
    if (contains(id)) ids_[slot_of(id)] = 0;
  }
  bool contains(Id id) const { return slot_of(id) < ids_.size() && ids_[slot_of(id)] == id; }

 private:
  std::vector<Id> ids_;  // by slot, 0 for none
};

}  // namespace flatland
