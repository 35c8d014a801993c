// A container whose ids consist of a slot and a generation, which counts the earlier uses of the
// slot.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace flatland {

// 4 bits of kind, 28 bits of generation and 32 bits of slot. Kinds are from 1 to 7, so that ids of
// different kinds differ, no id is 0, and ids are positive as signed integers.
using Id = std::uint64_t;

enum class IdKind : std::uint64_t {
  kBody = 1,
  kFixture = 2,
  kJoint = 3,
  kController = 4,
  kRecord = 5,
  kTouches = 6
};

// Values by id. The id of an erased value is never valid again, even if its slot is reused.
template <typename Value, IdKind kKind>
class SlotMap {
 public:
  Id insert(Value value) {
    std::uint32_t slot;
    if (free_.empty()) {
      slot = static_cast<std::uint32_t>(slots_.size());
      slots_.push_back({std::move(value), 0, true});
    } else {
      slot = free_.back();
      free_.pop_back();
      slots_[slot].value = std::move(value);
      slots_[slot].used = true;
    }
    ++size_;
    return make_id(slot);
  }

  // Returns the value, or null if the id is unknown or its value was erased.
  Value* find(Id id) {
    const auto slot = static_cast<std::uint32_t>(id);
    if (slot >= slots_.size() || !slots_[slot].used || make_id(slot) != id) return nullptr;
    return &slots_[slot].value;
  }
  const Value* find(Id id) const { return const_cast<SlotMap*>(this)->find(id); }

  void erase(Id id) {
    if (find(id) == nullptr) return;
    const auto slot = static_cast<std::uint32_t>(id);
    slots_[slot].value = Value{};
    slots_[slot].used = false;
    --size_;
    // A slot without unused generations is not reused.
    if (slots_[slot].generation < kLastGeneration) {
      ++slots_[slot].generation;
      free_.push_back(slot);
    }
  }

  // Calls visit(id, value) for each value in order of slots.
  template <typename Visit>
  void for_each(Visit&& visit) {
    for (std::uint32_t slot = 0; slot < slots_.size(); ++slot) {
      if (slots_[slot].used) visit(make_id(slot), slots_[slot].value);
    }
  }

  void reserve(std::size_t more) { slots_.reserve(slots_.size() + more); }
  std::size_t size() const { return size_; }

  void clear() {
    slots_.clear();
    free_.clear();
    size_ = 0;
  }

 private:
  static constexpr std::uint32_t kLastGeneration = (1U << 28U) - 1U;

  struct Slot {
    Value value;
    std::uint32_t generation;
    bool used;
  };

  Id make_id(std::uint32_t slot) const {
    return static_cast<Id>(kKind) << 60U | static_cast<Id>(slots_[slot].generation) << 32U | slot;
  }

  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::size_t size_ = 0;
};

}  // namespace flatland
