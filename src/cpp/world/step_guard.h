// Keeps a step stable and cheap where bodies overlap walls for which they have no room.
//
// Box2D 2.4 re-evaluates contacts at intermediate positions while it handles times of impact. In a
// gap narrower than the body that drops the stored impulse of one side and keeps that of the other,
// and warm starting applies the difference: it can grow until it overflows. The same body causes
// hundreds of times of impact in each step. The guard limits both, and never changes a step that
// stays within its limits.
#pragma once

#include <box2d/b2_body.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "world/slot_map.h"

class b2Contact;
class b2World;

namespace flatland {

// Whether the pose and the velocity of a body are finite.
bool is_finite(const b2Body* body);

// The bodies for which the last step needed the guard.
struct StepReport {
  std::vector<Id> limited;  // their contacts or velocities were limited
  std::vector<Id> invalid;  // their pose or velocity is not finite

  bool empty() const { return limited.empty() && invalid.empty(); }
};

class StepGuard {
 public:
  // Adds to the speed [m/s or rad/s] that one second of the forces on a body may cause in the next
  // step.
  void add_acceleration(Id body, float linear, float angular);

  // Called before and after b2World::Step.
  void begin(b2World& world, float dt);
  StepReport end(b2World& world);

  // Called for each contact that is about to be solved, after any other hook.
  void pre_solve(b2Contact* contact) noexcept;

 private:
  // What a body had before the step, and what it may have after it, by the slot of its id.
  struct Start {
    double energy = 0.0;   // kinetic [J], including what forces may add
    double allowed = 0.0;  // the larger one of this energy and that before the previous step
    float acceleration = 0.0F;
    float angular_acceleration = 0.0F;
    b2Vec2 position{0.0F, 0.0F};  // of static bodies only
    float angle = 0.0F;
    std::uint64_t step = 0;          // in which the body was examined last
    std::uint64_t last_jam = 0;      // the latest step in which it was limited
    std::uint64_t jammed_steps = 0;  // in succession, up to that one
  };

  Start& start_of(const b2Body* body);
  void limit(b2Body* body);
  void examine_group(b2Body* first);
  void restore_static(b2Body* body);

  const b2World* world_ = nullptr;
  float largest_impulse_ = 0.0F;
  bool has_accelerations_ = false;
  bool failed_ = false;  // for want of memory: contacts are not counted any more in this step
  std::uint64_t step_ = 0;
  std::vector<Start> starts_;
  std::vector<b2Body*> group_;
  std::unordered_map<const b2Contact*, int> updates_;
  std::vector<b2Body*> limited_;
};

}  // namespace flatland
