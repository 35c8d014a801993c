// Keeps a step stable and fast if bodies are jammed: they overlap walls and have no room to move
// away.
//
// While Box2D 2.4 handles times of impact, contacts are evaluated again at intermediate positions.
// In a gap that is narrower than the body, this removes the stored impulse of one side of the body
// and keeps the impulse of the other side. Warm starting applies the difference, which can grow
// until the velocity overflows. The same body causes hundreds of times of impact in each step. The
// guard limits the impulses and the number of impacts, and does not change a step within the
// limits.
#pragma once

#include <box2d/b2_body.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "world/bodies_by_type.h"
#include "world/slot_map.h"

class b2Contact;
class b2World;

namespace flatland {

// Returns whether the pose and the velocity of a body are finite.
bool is_finite(const b2Body* body);

// The bodies that the guard has limited or found to be invalid in the last step.
struct StepReport {
  std::vector<Id> limited;  // bodies whose contacts or velocities were limited
  std::vector<Id> invalid;  // bodies whose pose or velocity is not finite

  bool empty() const { return limited.empty() && invalid.empty(); }
};

class StepGuard {
 public:
  // Adds an acceleration that forces may cause in the next step [m/s², rad/s²].
  void add_acceleration(Id body, float linear, float angular);

  // Must be called before and after b2World::Step.
  void begin(const b2World& world, const BodiesByType& bodies, float dt);
  StepReport end(const BodiesByType& bodies);

  // Must be called before each contact is solved, after any other hook.
  void pre_solve(b2Contact* contact) noexcept;
  // Must be called after each contact is solved.
  void post_solve(b2Contact* contact) noexcept;

 private:
  // The state of a body before the step, and the energy that is allowed after the step.
  struct Start {
    Id body = 0;
    double energy = 0.0;   // kinetic energy, including the energy that forces may add [J]
    double allowed = 0.0;  // maximum of `energy` before this step and before the previous step [J]
    float acceleration = 0.0F;
    float angular_acceleration = 0.0F;
    b2Vec2 position{0.0F, 0.0F};  // set only for static bodies, like `angle`
    float angle = 0.0F;
    std::uint64_t step = 0;          // latest step in which the body was examined
    std::uint64_t last_jam = 0;      // latest step in which the body was limited
    std::uint64_t jammed_steps = 0;  // number of consecutive such steps up to `last_jam`
  };

  // Returns the state of a body; an empty one for a new body, also in the slot of a former one.
  Start& make_start(Id body);
  Start& start_of(const b2Body* body);
  // Returns the number of steps for which a body of the contact has been limited.
  std::uint64_t jammed_steps(b2Contact* contact);
  void limit_bodies(b2Contact* contact);
  void limit(b2Body* body);
  void examine_group(b2Body* first);
  void restore_static(b2Body* body);

  const b2World* world_ = nullptr;
  float largest_impulse_ = 0.0F;
  bool has_accelerations_ = false;
  bool failed_ = false;  // whether counting contacts failed for lack of memory in this step
  std::uint64_t step_ = 0;
  std::vector<Start> starts_;  // by the slot of the id of the body
  std::vector<b2Body*> group_;
  std::unordered_map<const b2Contact*, int> updates_;
  std::vector<b2Body*> limited_;
};

}  // namespace flatland
