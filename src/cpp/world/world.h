// The world, which owns a Box2D world and all objects in it and assigns ids to them.
//
// Only one thread at a time may use a world, except that several threads may cast rays
// concurrently. While the world is stepping or creating edges, every other use throws
// WorldLockedError, except that a pre-solve hook may read the world in the stepping thread. Changes
// wait until all rays are cast. Worlds share no state.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_joint.h>
#include <box2d/b2_world.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "parallel/thread_pool.h"
#include "rays/ray_scene.h"
#include "world/contacts.h"
#include "world/slot_map.h"
#include "world/step_plan.h"

namespace flatland {

// A joint with the parameters of the spring of a weld joint, which Box2D does not store.
struct JointRecord {
  b2Joint* joint = nullptr;
  float frequency = 0.0F;
  float damping_ratio = 0.0F;
};

// How many steps a call of `World::run` performed, and why it ended.
struct RunResult {
  enum class End : std::uint8_t {
    kDone,     // all steps were performed
    kCall,     // code is to be called in the next step, which has not begun
    kFailed,   // the next step has begun, and a controller has failed before the physics step
    kPhysics,  // the next step has begun, and its physics step was performed, but nothing after it
    kStopped,  // `interrupt` was called, or the run reached its time limit
  };

  std::int64_t steps = 0;  // complete steps
  End end = End::kDone;
  StepReport report;
};

class World final : private b2DestructionListener {
 public:
  World();
  ~World() override;
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // Destroys all objects; all ids become stale. Idempotent.
  void close();
  bool closed() const { return engine_ == nullptr; }

  // Makes this world an exact copy of another one, with the same ids; see copy.cpp. Ids of this
  // world that do not exist in the other one become stale and are not used again. If there is not
  // enough memory, this world is unchanged. The caches of ray casting are shared.
  void become_copy_of(World& source);
  // Destroys all objects except clocks. The results of the same further calls are those of a new
  // world, except for the generations of ids.
  void clear();

  // Advances the world by dt > 0 seconds. The hook may be null. The caller has exclusive use of the
  // world. While a body is invalid the world does not advance, and the report names the body again.
  StepReport step(double dt, int velocity_iterations, int position_iterations, PreSolveHook* hook);
  // Performs up to n steps without calling code, from step k (counted from time 0) on. Ends early
  // as described in RunResult; with `only_physics`, after the first physics step. The caller has
  // exclusive use of the world.
  RunResult run(std::int64_t k, std::int64_t n, double dt, int velocity_iterations,
                int position_iterations, bool only_physics);
  // Makes `run` return after the current step, and `wait_until` at once; safe from any thread. It
  // has an effect until `clear_interrupt` is called.
  void interrupt();
  void clear_interrupt() { interrupted_ = false; }
  // Waits for a time unless interrupted. Returns whether the time has come. Requires no use of the
  // world.
  bool wait_until(std::chrono::steady_clock::time_point time);

  // Duration of the last step in wall time [s], an estimate of that of the next one.
  double last_step_time() const { return last_step_time_; }

  // Access to objects by id. Throw StaleHandleError if the object was destroyed or the world is
  // closed, and WorldLockedError if the world is in use. Pointers are valid until the next change.
  const b2Body* read_body(Id id) const;
  const b2Fixture* read_fixture(Id id) const;
  const JointRecord& read_joint(Id id) const;
  b2Body* change_body(Id id);
  b2Fixture* change_fixture(Id id);
  b2Joint* change_joint(Id id);
  // Numbers of bodies, fixtures, joints and contacts, including contacts of fixtures that only
  // overlap in the broad phase.
  std::array<std::size_t, 4> object_counts() const;
  bool has_body(Id id) const { return bodies_.find(id) != nullptr; }
  bool has_fixture(Id id) const { return fixtures_.find(id) != nullptr; }
  bool has_joint(Id id) const { return joints_.find(id) != nullptr; }

  // Throw the same exceptions if the world cannot be read or changed at present.
  void check_readable() const;
  void check_changeable() const;

  // Creation from checked definitions, and destruction. Destroying a body also destroys its
  // fixtures and joints.
  Id add_body(const b2BodyDef& definition);
  Id add_fixture(b2Body* body, const b2FixtureDef& definition);
  // To be called before and after adding many fixtures to one static body; see broad_phase.h.
  void reserve_fixtures(std::size_t more) { fixtures_.reserve(more); }
  void skip_static_fixtures(int32 pending_before);
  // Searches for pairs of fixtures that may touch, which the next step would do otherwise.
  void find_new_contacts();
  Id add_joint(const b2JointDef& definition, float frequency, float damping_ratio);
  void destroy_body(Id id);
  void destroy_joint(Id id);

  // Wakes the bodies in contact with a body, and the dynamic bodies that its bounding box overlaps.
  void wake_neighbours(const b2Body* body);
  // To be called after a change of the filter or the sensor flag of a fixture.
  void fixture_changed(const b2Fixture* fixture);

  const b2World& engine() const { return *engine_; }
  ContactRecorder& contacts() { return contacts_; }
  const ContactRecorder& contacts() const { return contacts_; }
  RayScene& rays() { return rays_; }
  StepPlan& plan() { return plan_; }
  // Null if the object was destroyed; for the steps of a plan.
  b2Body* find_body(Id id) {
    b2Body* const* body = bodies_.find(id);
    return body == nullptr ? nullptr : *body;
  }
  b2Joint* find_joint(Id id) {
    const JointRecord* joint = joints_.find(id);
    return joint == nullptr ? nullptr : joint->joint;
  }
  // Workers for calls on this world, or on several worlds of which this is the first. They may be
  // used while the world is in shared or exclusive use by the calling thread.
  ThreadPool& threads() { return threads_; }

  static constexpr const char* kStepping = "is stepping";

  // Exclusive use of the world by one thread, for long changes without the GIL. Both kinds of use
  // must start with the GIL held, because short changes are synchronized only by the GIL.
  class ExclusiveUse {
   public:
    ExclusiveUse(World& world, const char* activity);
    ~ExclusiveUse() { end(); }
    void end();
    ExclusiveUse(const ExclusiveUse&) = delete;
    ExclusiveUse& operator=(const ExclusiveUse&) = delete;

   private:
    World* world_;
  };

  // Shared use of the world by threads that only read it. Threads that change the world hold the
  // GIL while they wait for the end of all shared uses, so a use must end before its thread
  // acquires the GIL.
  class SharedUse {
   public:
    explicit SharedUse(World& world);
    ~SharedUse() { end(); }
    void end();
    SharedUse(const SharedUse&) = delete;
    SharedUse& operator=(const SharedUse&) = delete;

   private:
    World* world_;
  };

 private:
  // Receives the events of a new engine.
  void listen();
  void SayGoodbye(b2Joint* joint) override;
  void SayGoodbye(b2Fixture* fixture) override;
  std::vector<Id> still_invalid() const;
  StepReport step_unchecked(double dt, int velocity_iterations, int position_iterations,
                            PreSolveHook* hook);
  [[noreturn]] void throw_locked() const;
  void wait_for_readers() const;

  static constexpr int kExclusive = -1;

  std::unique_ptr<b2World> engine_;
  SlotMap<b2Body*, IdKind::kBody> bodies_;
  SlotMap<b2Fixture*, IdKind::kFixture> fixtures_;
  SlotMap<JointRecord, IdKind::kJoint> joints_;
  ContactRecorder contacts_;
  RayScene rays_{fixtures_};
  StepPlan plan_;
  ThreadPool threads_;
  double last_step_time_ = 1.0;  // the first step may be long
  std::vector<Id> invalid_;      // bodies that the last step left so

  std::atomic<bool> interrupted_{false};
  std::mutex interrupt_mutex_;
  std::condition_variable interrupt_;
  std::atomic<int> users_{0};  // kExclusive, or the number of shared uses
  std::atomic<std::thread::id> owner_{};
  std::atomic<const char*> activity_{nullptr};
};

}  // namespace flatland
