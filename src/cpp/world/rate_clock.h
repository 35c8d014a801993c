// When updates at a rate are due.
#pragma once

#include <cstdint>

namespace flatland {

// The steps in which the updates of a rate are due, in integers, so that nothing drifts. With the
// rate weight / cycle in updates per half nanosecond, an update is due at time t if
//     (2 t + step) * weight mod cycle < 2 * step * weight,
// that is, if an update falls into the interval of a step around t. The formula is that of
// UpdateTimer in Python. A rate of at least one update in each step is due in every step.
class RateClock {
 public:
  __extension__ using Wide = unsigned __int128;

  // The weight is below 2^62, and the cycle is positive and below 2^127.
  RateClock(std::uint64_t weight, Wide cycle) : weight_(weight), cycle_(cycle) {}

  bool operator==(const RateClock& other) const {
    return weight_ == other.weight_ && cycle_ == other.cycle_;
  }

  // Moves the clock to a time, after which `is_due` refers to that time; both in nanoseconds.
  void move_to(std::int64_t time, std::int64_t step) {
    const Wide window = 2 * static_cast<Wide>(step) * weight_;
    if (window >= cycle_) {
      is_due_ = true;
      return;
    }
    if (step == step_ && time == time_) return;
    if (step != step_ || time != time_ + step) {
      const Wide middle = 2 * static_cast<Wide>(time) + static_cast<Wide>(step);
      phase_ = middle * weight_ % cycle_;
    } else {
      phase_ += window;
      if (phase_ >= cycle_) phase_ -= cycle_;
    }
    is_due_ = phase_ < window;
    time_ = time;
    step_ = step;
  }
  bool is_due() const { return is_due_; }

 private:
  std::uint64_t weight_;
  Wide cycle_;
  Wide phase_ = 0;          // at time_
  std::int64_t time_ = 0;   // of the last move
  std::int64_t step_ = -1;  // of the last move; no move before the first one
  bool is_due_ = false;
};

}  // namespace flatland
