#include "world/world.h"

#include <box2d/b2_circle_shape.h>
#include <box2d/b2_contact.h>

#include <chrono>
#include <mutex>
#include <new>
#include <stdexcept>

#include "world/broad_phase.h"
#include "world/errors.h"
#include "world/joints.h"

namespace flatland {
namespace {

// Box2D initializes a global table without a lock when the first contact of the process is created.
// Creating a contact here prevents a race between worlds in different threads.
void initialize_contact_table() {
  static std::once_flag once;
  std::call_once(once, [] {
    b2World world({0.0F, 0.0F});
    b2BodyDef definition;
    definition.type = b2_dynamicBody;
    b2CircleShape circle;
    circle.m_radius = 1.0F;
    for (int i = 0; i < 2; ++i) world.CreateBody(&definition)->CreateFixture(&circle, 1.0F);
    world.Step(0.01F, 1, 1);
  });
}

using Clock = std::chrono::steady_clock;

// Wall time after which a run ends, so that Python can handle signals [s].
constexpr double kLongRun = 0.05;

class WakeDynamicBodies final : public b2QueryCallback {
 public:
  bool ReportFixture(b2Fixture* fixture) override {
    if (fixture->GetBody()->GetType() == b2_dynamicBody) fixture->GetBody()->SetAwake(true);
    return true;
  }
};

void check_step(double dt, int velocity_iterations, int position_iterations) {
  // Outside these bounds, 1 / dt or sums in the solver can exceed the range of a float.
  if (!(dt >= 1e-6 && dt <= 1e3)) {
    throw std::invalid_argument("dt must be from 1e-6 to 1000 s, got " + to_text(dt));
  }
  for (const int iterations : {velocity_iterations, position_iterations}) {
    if (iterations < 0) {
      throw std::invalid_argument("iterations must not be negative, got " +
                                  std::to_string(iterations));
    }
  }
}

}  // namespace

World::World() : engine_(make_engine()) {
  initialize_contact_table();
  structure_changed();
  listen();
}

void World::listen() {
  engine_->SetDestructionListener(this);
  engine_->SetContactListener(&contacts_);
}

World::~World() = default;

void World::close() {
  if (closed()) return;
  check_changeable();
  threads_.stop();
  rays_.clear();
  bodies_.clear();
  fixtures_.clear();
  joints_.clear();
  contacts_ = ContactRecorder();
  invalid_.clear();
  jobs_.clear();
  engine_.reset();
  walls_ = NearWalls();
  interrupt();
}

StepReport World::step(double dt, int velocity_iterations, int position_iterations,
                       PreSolveHook* hook) {
  check_step(dt, velocity_iterations, position_iterations);
  const auto start = Clock::now();
  bodies_by_type_.read(*engine_);
  StepReport report = step_unchecked(dt, velocity_iterations, position_iterations, hook, false);
  last_step_time_ = std::chrono::duration<double>(Clock::now() - start).count();
  return report;
}

StepReport World::step_unchecked(double dt, int velocity_iterations, int position_iterations,
                                 PreSolveHook* hook, bool may_coast) {
  if (!invalid_.empty()) {
    invalid_ = still_invalid();
    if (!invalid_.empty()) return {{}, invalid_};
  }
  const auto seconds = static_cast<float>(dt);
  StepGuard& guard = contacts_.guard;
  guard.begin(*engine_, bodies_by_type_, seconds);
  contacts_.hook = hook;
  contacts_.begin_step();
  // A hook is called within the step, and may read the state of any body.
  const bool is_done = hook == nullptr && free_motion_.begin(*engine_, bodies_by_type_, seconds,
                                                             position_iterations, may_coast);
  if (!is_done) {
    walls_.create(*engine_, seconds);
    begin_step(*engine_);
    engine_->Step(seconds, velocity_iterations, position_iterations);
    walls_.create(*engine_, 0.0F);
    // The guard restores the pose of a static body that has overflowed, with its fixtures.
    if (walls_.has_invalid_body()) own_walls();
  }
  if (hook == nullptr) free_motion_.end();
  contacts_.hook = nullptr;
  StepReport report = guard.end(bodies_by_type_);
  invalid_ = report.invalid;
  if (contacts_.take_failure()) throw std::bad_alloc();
  return report;
}

void Run::check() const {
  check_step(dt, velocity_iterations, position_iterations);
  // Sums of times do not overflow.
  constexpr std::int64_t kMost = std::int64_t{1} << 61;
  if (n < 0 || n > kMost || time < 0 || time > kMost || step < 1 || step > kMost) {
    throw std::invalid_argument("times and numbers of steps must be from 0 to 2^61");
  }
}

RunResult World::run(const Run& run) {
  run.check();
  bodies_by_type_.read(*engine_);  // a run creates and destroys no bodies
  struct CatchUp {
    FreeMotion& motion;
    ~CatchUp() { motion.catch_up(); }
  } const at_end{free_motion_};
  const auto start = Clock::now();
  // Reading the wall time takes about as long as a step of one body.
  constexpr std::int64_t kMostUntimed = 16;
  std::int64_t untimed = 0;
  std::int64_t time = run.time;
  RunResult result;
  if (!run.continues) stage_ = Stage::kStart;
  while (result.steps < run.n) {
    if (stage_ == Stage::kStart) {
      if (is_interrupted()) break;
      if (++untimed > kMostUntimed || last_step_time_ > kLongRun / kMostUntimed) {
        untimed = 0;
        const std::chrono::duration<double> elapsed = Clock::now() - start;
        if (result.steps > 0 && elapsed.count() > kLongRun) break;
      }
    }
    if (!perform(run, time, result)) break;
    ++result.steps;
    time += run.step;
  }
  const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
  if (result.physics_steps > 0) {
    last_step_time_ = elapsed / static_cast<double>(result.physics_steps);
  }
  return result;
}

double World::expected_time(const Run& run) {
  // The clocks must not be moved within a step.
  const bool is_one = !run.continues && jobs_.calls_at(run.time, run.step);
  return last_step_time_ * static_cast<double>(is_one ? 1 : run.n);
}

bool World::perform(const Run& run, std::int64_t time, RunResult& result) {
  using End = RunResult::End;
  if (stage_ == Stage::kStart) {
    jobs_.begin(time, run.step);
    stage_ = Stage::kBefore;
  }
  if (stage_ == Stage::kBefore) {
    if (hand_back(Phase::kBefore, result, run.dt)) {
      result.end = End::kBefore;
      return false;
    }
    stage_ = Stage::kPhysics;
    if (run.calls_physics) {
      stage_ = Stage::kAfter;
      result.end = End::kPhysics;
      return false;
    }
  }
  if (stage_ == Stage::kPhysics) {
    const bool is_last = result.steps + 1 >= run.n;
    result.report =
        step_unchecked(run.dt, run.velocity_iterations, run.position_iterations, nullptr, !is_last);
    ++result.physics_steps;
    stage_ = Stage::kAfter;
    if (!result.report.empty() || contacts_.has_rows()) {
      result.end = End::kAfterPhysics;
      return false;
    }
  }
  if (hand_back(Phase::kAfter, result, run.dt)) {
    const bool is_last = jobs_.is_complete(Phase::kAfter);
    result.end = is_last ? End::kLastCalls : End::kAfter;
    if (is_last) stage_ = Stage::kStart;
    return false;
  }
  stage_ = Stage::kStart;
  return true;
}

bool World::hand_back(Phase phase, RunResult& result, double dt) {
  result.calls = jobs_.carry_out(*this, phase, dt);
  result.failed = jobs_.take_failed();
  return !result.calls.empty() || !result.failed.empty();
}

void World::interrupt() {
  {
    const std::lock_guard<std::mutex> lock(interrupt_mutex_);
    ++interrupts_;
  }
  interrupt_.notify_all();
}

bool World::wait_until(std::chrono::steady_clock::time_point time) {
  std::unique_lock<std::mutex> lock(interrupt_mutex_);
  return !interrupt_.wait_until(lock, time, [this] { return is_interrupted(); });
}

void World::prefetch(int stage) const {
  if (stage == 0) {
    flatland::prefetch(this, sizeof(World));
  } else if (stage == 1) {
    // The engine contains a large buffer, which is not used here, before its other members.
    flatland::prefetch(&engine_->GetContactManager(), 2 * sizeof(b2ContactManager));
    bodies_.prefetch();
    jobs_.prefetch();
  } else {
    for (const b2Body* body = engine_->GetBodyList(); body != nullptr; body = body->GetNext()) {
      flatland::prefetch(body, sizeof(b2Body));
      if (body->GetType() == b2_staticBody) continue;
      for (const b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
        flatland::prefetch(f, sizeof(b2Fixture));
        flatland::prefetch(f->GetShape(), sizeof(b2CircleShape));
      }
    }
  }
}

std::vector<Id> World::still_invalid() const {
  std::vector<Id> ids;
  for (const Id id : invalid_) {
    b2Body* const* body = bodies_.find(id);
    if (body != nullptr && !is_finite(*body)) ids.push_back(id);
  }
  return ids;
}

const b2Body* World::read_body(Id id) const {
  check_readable();
  b2Body* const* body = bodies_.find(id);
  if (body == nullptr) throw StaleHandleError("the body was destroyed");
  return *body;
}

std::array<std::size_t, 4> World::object_counts() const {
  check_readable();
  return {bodies_.size(), fixtures_.size(), joints_.size(),
          static_cast<std::size_t>(engine_->GetContactCount())};
}

std::array<Id, 2> World::newest_objects() const {
  check_readable();
  const b2Body* body = engine_->GetBodyList();
  const b2Joint* joint = engine_->GetJointList();
  return {body == nullptr ? 0 : id_of(body), joint == nullptr ? 0 : id_of(joint)};
}

std::array<std::vector<Id>, 2> World::objects_since(const std::array<Id, 2>& newest) const {
  check_readable();
  // In the lists of Box2D, the newest object is the first one.
  const auto since = [](const auto* object, Id last) {
    std::vector<Id> ids;
    for (; object != nullptr && id_of(object) != last; object = object->GetNext()) {
      ids.push_back(id_of(object));
    }
    if (object == nullptr && last != 0) ids.clear();  // which are new is not known
    return ids;
  };
  return {since(static_cast<const b2World&>(*engine_).GetBodyList(), newest[0]),
          since(static_cast<const b2World&>(*engine_).GetJointList(), newest[1])};
}

const b2Fixture* World::read_fixture(Id id) const {
  check_readable();
  b2Fixture* const* fixture = fixtures_.find(id);
  if (fixture == nullptr) throw StaleHandleError("the fixture was destroyed");
  return *fixture;
}

const JointRecord& World::read_joint(Id id) const {
  check_readable();
  const JointRecord* joint = joints_.find(id);
  if (joint == nullptr) throw StaleHandleError("the joint was destroyed");
  return *joint;
}

b2Body* World::change_body(Id id) {
  check_changeable();
  auto* body = const_cast<b2Body*>(read_body(id));
  if (has_shared_walls(*body)) own_walls();
  return body;
}

b2Fixture* World::change_fixture(Id id) {
  check_changeable();
  if (has_shared_walls(*read_body(id_of(read_fixture(id)->GetBody())))) own_walls();
  return const_cast<b2Fixture*>(read_fixture(id));
}

b2Joint* World::change_joint(Id id) {
  check_changeable();
  return read_joint(id).joint;
}

void World::check_readable() const {
  if (users_.load() == kExclusive && owner_.load() != std::this_thread::get_id()) throw_locked();
  if (closed()) throw StaleHandleError("the world is closed");
}

void World::check_changeable() const {
  wait_for_readers();
  if (users_.load() == kExclusive) throw_locked();
  if (closed()) throw StaleHandleError("the world is closed");
}

void World::wait_for_readers() const {
  // A scan takes microseconds, which is less than the time to sleep and wake up.
  while (users_.load() > 0) std::this_thread::yield();
}

void World::throw_locked() const {
  const char* activity = activity_.load();
  throw WorldLockedError(std::string("the world ") +
                         (activity == nullptr ? "is in use" : activity) +
                         " and cannot be changed or used by other threads");
}

Id World::add_body(const b2BodyDef& definition) {
  check_changeable();
  structure_changed();
  b2Body* body = engine_->CreateBody(&definition);
  mass_changed(body);
  const Id id = bodies_.insert(body);
  body->GetUserData().pointer = id;
  return id;
}

Id World::add_fixture(b2Body* body, const b2FixtureDef& definition) {
  if (has_shared_walls(*body)) own_walls();
  structure_changed();
  b2Fixture* fixture = body->CreateFixture(&definition);
  mass_changed(body);
  const Id id = fixtures_.insert(fixture);
  fixture->GetUserData().pointer = id;
  rays_.add(fixture);
  return id;
}

Id World::add_joint(const b2JointDef& definition, float frequency, float damping_ratio) {
  check_changeable();
  structure_changed();
  b2Joint* joint = engine_->CreateJoint(&definition);
  const Id id = joints_.insert({joint, frequency, damping_ratio});
  joint->GetUserData().pointer = id;
  joint->GetBodyA()->SetAwake(true);
  joint->GetBodyB()->SetAwake(true);
  return id;
}

void World::find_new_contacts() {
  check_changeable();
  walls_.create(*engine_, 0.0F);
  find_new_pairs(*engine_);
}

void World::share_walls() {
  check_changeable();
  if (walls_.are_shared()) return;
  walls_.share(*engine_);
  if (!walls_.are_shared()) return;
  structure_changed();
  for (b2Fixture* fixture : walls_.shared()->fixtures()) *fixtures_.find(id_of(fixture)) = fixture;
}

void World::own_walls() {
  structure_changed();
  const std::vector<b2Body*> bodies = walls_.own(*engine_);
  for (b2Body* body : bodies) {
    for (b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
      *fixtures_.find(id_of(f)) = f;
    }
  }
}

void World::destroy_body(Id id) {
  b2Body* body = change_body(id);
  structure_changed();
  // For each destroyed fixture, Box2D searches the list of all fixtures that were created or moved
  // since the last search for new pairs. For a large map that is destroyed before the first step
  // this would take hours. The search clears the list.
  constexpr int32 kMany = 2000;
  if (pending_fixtures(*engine_) > kMany) find_new_contacts();
  rays_.remove_body(body);
  engine_->DestroyBody(body);  // calls SayGoodbye for its fixtures and joints
  bodies_.erase(id);
  jobs_.remove_body(id);
  contacts_.record_body(id, 0);
  contacts_.touches.set_owned(id, false);
}

void World::destroy_joint(Id id) {
  b2Joint* joint = change_joint(id);
  structure_changed();
  engine_->DestroyJoint(joint);
  joints_.erase(id);
}

void World::SayGoodbye(b2Joint* joint) { joints_.erase(joint->GetUserData().pointer); }

void World::SayGoodbye(b2Fixture* fixture) { fixtures_.erase(fixture->GetUserData().pointer); }

void World::wake_neighbours(const b2Body* body) {
  for (const b2ContactEdge* edge = body->GetContactList(); edge != nullptr; edge = edge->next) {
    edge->other->SetAwake(true);
  }
  const b2Fixture* fixture = body->GetFixtureList();
  if (fixture == nullptr) return;
  b2AABB bounds = fixture->GetAABB(0);
  for (; fixture != nullptr; fixture = fixture->GetNext()) bounds.Combine(fixture->GetAABB(0));
  WakeDynamicBodies callback;
  engine_->QueryAABB(&callback, bounds);
}

void World::structure_changed() {
  static std::atomic<std::uint64_t> last{0};
  structure_ = ++last;
}

void World::mass_changed(b2Body* body) {
  if (body->GetType() != b2_dynamicBody) return;
  if (!(body->GetMass() > 0.0F)) {
    // 1 kg with an infinite moment of inertia, as in Box2D up to 2.3. In Box2D 2.4 a body without
    // mass cannot be moved, nor can a robot that is welded to it.
    b2MassData data;
    data.mass = 1.0F;
    data.center.SetZero();
    data.I = 0.0F;
    body->SetMassData(&data);
  }
  for (const b2JointEdge* edge = body->GetJointList(); edge != nullptr; edge = edge->next) {
    const JointRecord& record = *joints_.find(id_of(edge->joint));
    set_spring(edge->joint, record.frequency, record.damping_ratio);
  }
}

void World::fixture_changed(const b2Fixture* fixture) {
  structure_changed();
  rays_.changed(fixture);
  auto* body = const_cast<b2Body*>(fixture->GetBody());
  body->SetAwake(body->GetType() != b2_staticBody);
  wake_neighbours(body);
}

void World::set_material(const b2Fixture* fixture, const Material& material) {
  rays_.set_material(fixture, material);
  // Scans may be random from now on.
  interrupt();
}

World::ExclusiveUse::ExclusiveUse(World& world, const char* activity) : world_(&world) {
  int users = 0;
  while (!world.users_.compare_exchange_weak(users, kExclusive)) {
    if (users == kExclusive) world.throw_locked();
    world.wait_for_readers();
    users = 0;
  }
  // The order of these stores has no effect: no other thread can read its own id here.
  world.activity_.store(activity, std::memory_order_relaxed);
  world.owner_.store(std::this_thread::get_id(), std::memory_order_relaxed);
  if (world.closed()) {
    end();
    throw StaleHandleError("the world is closed");
  }
}

void World::ExclusiveUse::end() {
  if (world_ == nullptr) return;
  world_->activity_.store(nullptr, std::memory_order_relaxed);
  world_->owner_.store(std::thread::id(), std::memory_order_relaxed);
  world_->users_.store(0, std::memory_order_release);
  world_ = nullptr;
}

World::SharedUse::SharedUse(World& world) : world_(&world) {
  int users = world.users_.load();
  do {
    if (users == kExclusive) world.throw_locked();
  } while (!world.users_.compare_exchange_weak(users, users + 1));
  if (world.closed()) {
    end();
    throw StaleHandleError("the world is closed");
  }
}

void World::SharedUse::end() {
  if (world_ != nullptr) --world_->users_;
  world_ = nullptr;
}

}  // namespace flatland
