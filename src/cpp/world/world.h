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
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "parallel/thread_pool.h"
#include "rays/ray_scene.h"
#include "world/contacts.h"
#include "world/free_motion.h"
#include "world/job_queue.h"
#include "world/shared_walls.h"
#include "world/slot_map.h"

namespace flatland {

// A joint with the parameters of the spring of a weld joint, which Box2D does not store.
struct JointRecord {
  b2Joint* joint = nullptr;
  float frequency = 0.0F;
  float damping_ratio = 0.0F;
};

// Steps to be performed by `World::run`.
struct Run {
  std::int64_t time = 0;  // simulated time at which the next step begins, or has begun [ns]
  std::int64_t step = 1;  // simulated time of a step [ns]
  std::int64_t n = 0;     // number of steps, including one that has begun
  double dt = 0.0;        // simulated time of a step [s]
  int velocity_iterations = 0;
  int position_iterations = 0;
  bool continues = false;      // whether the first step is the one that was handed back
  bool calls_physics = false;  // whether the physics step is performed by the caller

  void check() const;  // throws std::invalid_argument if a number is out of range
};

// How many steps `World::run` completed, and what is to be done outside of the core now. A step in
// which there is something to do is not complete; `Run::continues` completes it.
struct RunResult {
  enum class End : std::uint8_t {
    kDone,          // nothing; all steps were completed, or the run was interrupted
    kBefore,        // calls before the physics step
    kPhysics,       // the physics step itself
    kAfterPhysics,  // the report of the physics step and the contacts are to be examined
    kAfter,         // calls after the physics step
    kLastCalls,     // the same, and nothing is left to be done in this step afterwards
  };

  std::int64_t steps = 0;
  End end = End::kDone;
  StepReport report;
  std::vector<Id> calls;          // callbacks
  std::vector<FailedJob> failed;  // since the last result
  std::int64_t physics_steps = 0;
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
  // enough memory, this world is unchanged. The caches of ray casting are shared. Takes much less
  // time if this world is a former copy of the other one whose structure has not changed.
  void become_copy_of(World& source);
  // Destroys all objects except clocks. The results of the same further calls are those of a new
  // world, except for the generations of ids.
  void clear();

  // Advances the world by dt > 0 seconds. The hook may be null. The caller has exclusive use of the
  // world. While a body is invalid the world does not advance, and the report names the body again.
  StepReport step(double dt, int velocity_iterations, int position_iterations, PreSolveHook* hook);
  // Performs steps with their jobs, until something is to be done outside of the core, after an
  // interrupt, and after some time, so that Python can handle signals. The caller has exclusive use
  // of the world.
  RunResult run(const Run& run);
  // Makes `run` return after the current step, and `wait_until` at once; safe from any thread. It
  // has an effect until `clear_interrupt` is called.
  void interrupt();
  // Returns the number of interrupts that it clears.
  std::uint64_t clear_interrupt() {
    const std::uint64_t count = interrupts_.load();
    cleared_ = count;
    return count;
  }
  // Returns the number of interrupts so far. As long as it does not change, nothing outside of the
  // core has to be called before a run that code outside of the core has permitted.
  std::uint64_t interrupts() const { return interrupts_.load(std::memory_order_relaxed); }
  // Waits for a time unless interrupted. Returns whether the time has come. Requires no use of the
  // world.
  bool wait_until(std::chrono::steady_clock::time_point time);

  // Simulated time [ns], which the caller of `run` sets; safe from any thread.
  std::int64_t time() const { return time_.load(std::memory_order_relaxed); }
  void set_time(std::int64_t time) { time_.store(time, std::memory_order_relaxed); }
  // Duration of the last step in wall time [s], an estimate of that of the next one.
  double last_step_time() const { return last_step_time_; }
  // Returns the expected wall time of a run up to its first call [s].
  double expected_time(const Run& run);

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
  // Returns the newest body and joint, 0 for none.
  std::array<Id, 2> newest_objects() const;
  // Returns the bodies and joints that were created after some that still exist, or after none.
  std::array<std::vector<Id>, 2> objects_since(const std::array<Id, 2>& newest) const;
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
  // To be called before adding many fixtures.
  void reserve_fixtures(std::size_t more) { fixtures_.reserve(more); }
  // Searches for pairs of fixtures that may touch, which the next step would do otherwise.
  void find_new_contacts();
  // Replaces the fixtures of static bodies that have only edges by walls that all copies of this
  // world share; see shared_walls.h. Contacts with them end. A change of such a body gives the
  // world fixtures of its own again.
  void share_walls();
  Id add_joint(const b2JointDef& definition, float frequency, float damping_ratio);
  void destroy_body(Id id);
  void destroy_joint(Id id);

  // Wakes the bodies in contact with a body, and the dynamic bodies that its bounding box overlaps.
  void wake_neighbours(const b2Body* body);
  // To be called after each change of what the world consists of: objects, the properties of
  // fixtures, and the poses of static bodies.
  void structure_changed();
  // To be called after each call of Box2D that may have set the mass of a body. Establishes what
  // depends on the mass: the least mass, and the springs of joints.
  void mass_changed(b2Body* body);
  void set_material(const b2Fixture* fixture, const Material& material);
  // To be called after a change of the filter or the sensor flag of a fixture.
  void fixture_changed(const b2Fixture* fixture);

  const b2World& engine() const { return *engine_; }
  const NearWalls& walls() const { return walls_; }
  // The Box2D worlds for queries of all fixtures.
  Engines engines() const {
    return {*engine_, walls_.are_shared() ? &walls_.shared()->engine() : nullptr};
  }
  ContactRecorder& contacts() { return contacts_; }
  const ContactRecorder& contacts() const { return contacts_; }
  RayScene& rays() { return rays_; }
  JobQueue& jobs() { return jobs_; }
  // Null if the object was destroyed; for jobs, which may change it.
  b2Body* find_body(Id id) {
    b2Body* const* body = bodies_.find(id);
    if (body == nullptr) return nullptr;
    if (has_shared_walls(**body)) own_walls();
    if ((*body)->GetType() == b2_kinematicBody) catch_up();
    return *body;
  }
  // Gives all bodies the states of the present time, which kinematic bodies need not have during a
  // run. To be called by jobs before they read bodies other than by `find_body`.
  void catch_up() { free_motion_.catch_up(); }
  b2Joint* find_joint(Id id) {
    const JointRecord* joint = joints_.find(id);
    return joint == nullptr ? nullptr : joint->joint;
  }
  // Workers for calls on this world, or on several worlds of which this is the first. They may be
  // used while the world is in shared or exclusive use by the calling thread.
  ThreadPool& threads() { return threads_; }

  // Begins to load what a step needs into the cache, for callers that step many worlds in turn. To
  // be called with the stages from 0 on, while other worlds are stepped: each stage reads the
  // places of its data in data that the previous one has loaded. Another thread may step the world:
  // places are read only where steps do not change them.
  static constexpr int kPrefetchStages = 3;
  void prefetch(int stage) const;

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
  using ContactCopies = std::unordered_map<const b2Contact*, const b2Contact*>;
  // The parts of a copy besides the engine and the rays.
  struct OtherParts {
    ContactRecorder contacts;
    JobQueue jobs;
    std::vector<Id> invalid;
  };

  // Copies only what moves. Returns false, without any effect, if that is not possible.
  bool revert_to(World& source);
  OtherParts copy_others(const World& source, const ContactCopies& copies) const;
  void replace_others(const World& source, OtherParts parts);
  // Receives the events of a new engine.
  void listen();
  void SayGoodbye(b2Joint* joint) override;
  void SayGoodbye(b2Fixture* fixture) override;
  std::vector<Id> still_invalid() const;
  StepReport step_unchecked(double dt, int velocity_iterations, int position_iterations,
                            PreSolveHook* hook, bool may_coast);
  // Performs the current step from the current stage on. Returns whether it is complete; otherwise,
  // the result contains what is to be done.
  bool perform(const Run& run, std::int64_t time, RunResult& result);
  bool hand_back(Phase phase, RunResult& result, double dt);
  bool is_interrupted() const { return interrupts() != cleared_.load(std::memory_order_relaxed); }
  [[noreturn]] void throw_locked() const;
  void wait_for_readers() const;
  // Makes the walls of this world fixtures of its own.
  void own_walls();

  // What comes next in a step.
  enum class Stage : std::uint8_t { kStart, kBefore, kPhysics, kAfter };

  static constexpr int kExclusive = -1;

  NearWalls walls_;  // outlives the engine
  Engine engine_;
  std::uint64_t structure_ = 0;  // equal numbers of two worlds: they have the same structure
  SlotMap<b2Body*, IdKind::kBody> bodies_;
  SlotMap<b2Fixture*, IdKind::kFixture> fixtures_;
  SlotMap<JointRecord, IdKind::kJoint> joints_;
  ContactRecorder contacts_;
  FreeMotion free_motion_;
  BodiesByType bodies_by_type_;  // valid within a run
  RayScene rays_{fixtures_};
  JobQueue jobs_;
  Stage stage_ = Stage::kStart;
  ThreadPool threads_;
  double last_step_time_ = 1.0;  // the first step may be long
  std::vector<Id> invalid_;      // bodies that the last step left so

  std::atomic<std::int64_t> time_{0};
  std::atomic<std::uint64_t> interrupts_{0};
  std::atomic<std::uint64_t> cleared_{0};  // number of interrupts without an effect
  std::mutex interrupt_mutex_;
  std::condition_variable interrupt_;
  std::atomic<int> users_{0};  // kExclusive, or the number of shared uses
  std::atomic<std::thread::id> owner_{};
  std::atomic<const char*> activity_{nullptr};
};

}  // namespace flatland
