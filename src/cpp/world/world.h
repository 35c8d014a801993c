// The world: owns Box2D's world and everything in it, hands out ids, steps.
//
// A world may be used by one thread at a time, except that several threads may cast rays at once.
// While it steps, casts rays or makes edges, every other use is refused with WorldLockedError;
// only a pre-solve hook, in the stepping thread, may read. Worlds share nothing with each other.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_joint.h>
#include <box2d/b2_world.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rays/ray_scene.h"
#include "world/contacts.h"
#include "world/slot_map.h"

namespace flatland {

// A joint with what Box2D does not keep: a weld's spring as it was asked for.
struct JointRecord {
  b2Joint* joint = nullptr;
  float frequency = 0.0F;
  float damping_ratio = 0.0F;
};

class World final : private b2DestructionListener {
 public:
  World();
  ~World() override;
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // Frees everything; all ids are stale from then on. Again: does nothing.
  void close();
  bool closed() const { return engine_ == nullptr; }

  // Advances by dt > 0 seconds. The hook may be null. The caller holds the world exclusively. While
  // a body is invalid the world stands still: the report names the body again.
  StepReport step(double dt, int velocity_iterations, int position_iterations, PreSolveHook* hook);

  // Objects by id. Each throws StaleHandleError when the object or the world is gone, and
  // WorldLockedError when the world is busy. Pointers are good until the next change.
  const b2Body* read_body(Id id) const;
  const b2Fixture* read_fixture(Id id) const;
  const JointRecord& read_joint(Id id) const;
  b2Body* change_body(Id id);
  b2Fixture* change_fixture(Id id);
  b2Joint* change_joint(Id id);
  bool has_body(Id id) const { return bodies_.find(id) != nullptr; }
  bool has_fixture(Id id) const { return fixtures_.find(id) != nullptr; }
  bool has_joint(Id id) const { return joints_.find(id) != nullptr; }

  // Throw as above when the world cannot be read or changed now.
  void check_readable() const;
  void check_changeable() const;

  // Creation from checked definitions, and destruction. A body takes its fixtures and joints along.
  Id add_body(const b2BodyDef& definition);
  Id add_fixture(b2Body* body, const b2FixtureDef& definition);
  // Before and after many fixtures are added to one static body; see broad_phase.h.
  void reserve_fixtures(std::size_t more) { fixtures_.reserve(more); }
  void skip_static_fixtures(int32 waiting_before);
  // Searches for pairs of fixtures that may touch, which the next step would do otherwise.
  void find_new_contacts();
  Id add_joint(const b2JointDef& definition, float frequency, float damping_ratio);
  void destroy_body(Id id);
  void destroy_joint(Id id);

  // Wakes what rests against a body, or would be met by a body that was moved or reshaped.
  void wake_neighbours(const b2Body* body);
  // To be called after the category, or the sensor flag, of a fixture was changed.
  void fixture_changed(const b2Fixture* fixture);

  const b2World& engine() const { return *engine_; }
  ContactRecorder& contacts() { return contacts_; }
  const ContactRecorder& contacts() const { return contacts_; }
  RayScene& rays() { return rays_; }

  static constexpr const char* kStepping = "is stepping";

  // Holds the world for one thread that changes it for longer, without the GIL; made only where it
  // can be changed. Both kinds of use begin with the GIL, since short changes do not hold the world
  // and are kept apart by the GIL alone.
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

  // Holds the world as it is, for threads that only read. Who wants to change it waits for them,
  // with the GIL: a use must end before it is asked for again.
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
  void SayGoodbye(b2Joint* joint) override;
  void SayGoodbye(b2Fixture* fixture) override;
  std::vector<Id> still_invalid() const;
  [[noreturn]] void throw_locked() const;
  void wait_for_readers() const;

  static constexpr int kExclusive = -1;

  std::unique_ptr<b2World> engine_;
  SlotMap<b2Body*, IdKind::kBody> bodies_;
  SlotMap<b2Fixture*, IdKind::kFixture> fixtures_;
  SlotMap<JointRecord, IdKind::kJoint> joints_;
  ContactRecorder contacts_;
  RayScene rays_;
  std::vector<Id> invalid_;  // bodies that the last step left so

  std::atomic<int> users_{0};  // kExclusive, or how many threads cast rays
  std::atomic<std::thread::id> owner_{};
  std::atomic<const char*> activity_{nullptr};
};

}  // namespace flatland
