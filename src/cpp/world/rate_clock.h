// When updates at a rate are due.
#pragma once

#include <cstdint>

namespace flatland {

// The steps in which the updates of a rate are due, in integers, so that nothing drifts. Steps are
// counted from time 0. The numbers are those of UpdateTimer in Python, divided by their greatest
// common divisor.
class RateClock {
 public:
  enum class Kind : std::uint8_t {
    kPeriodic,  // due in step k if (2 k + 1) * half_step mod cycle < 2 * half_step
    kAlways,
    kAtStart,  // in step 0 only
    kNever,
  };

  RateClock(Kind kind, std::uint64_t half_step, std::uint64_t cycle)
      : kind_(kind), half_step_(half_step), cycle_(cycle) {}

  // Moves the clock to a step, after which `is_due` refers to that step.
  void move_to(std::int64_t step) {
    if (step == step_) return;
    if (kind_ == Kind::kPeriodic) {
      // Twice half_step_ is less than the cycle, which is below 2^63.
      phase_ = step == step_ + 1 ? phase_ + 2 * half_step_ : phase_at(step);
      if (phase_ >= cycle_) phase_ -= cycle_;
      is_due_ = phase_ < 2 * half_step_;
    } else {
      is_due_ = kind_ == Kind::kAlways || (kind_ == Kind::kAtStart && step == 0);
    }
    step_ = step;
  }
  bool is_due() const { return is_due_; }

 private:
  std::uint64_t phase_at(std::int64_t step) const {
    __extension__ using Wide = unsigned __int128;
    const Wide count = 2 * static_cast<Wide>(static_cast<std::uint64_t>(step)) + 1;
    return static_cast<std::uint64_t>(count % cycle_ * half_step_ % cycle_);
  }

  Kind kind_;
  std::uint64_t half_step_, cycle_;
  std::uint64_t phase_ = 0;
  std::int64_t step_ = -2;  // before any step, and not followed by one
  bool is_due_ = false;
};

}  // namespace flatland
