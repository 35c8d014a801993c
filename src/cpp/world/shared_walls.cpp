#include "world/shared_walls.h"

#include <box2d/b2_block_allocator.h>
#include <box2d/b2_contact.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_settings.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "world/box2d_members.h"
#include "world/broad_phase.h"
#include "world/contacts.h"
#include "world/step_guard.h"

namespace flatland {
namespace {

using members::get;

// Size of a cell [m], exceeded only to limit the number of cells along an axis.
constexpr float kCellSize = 1.0F;
constexpr float kMostCells = 1000.0F;
// Distance from the boxes of dynamic bodies within which walls are created at least [m].
constexpr float kMargin = 0.25F;

b2FixtureProxy& proxy_of(const b2Fixture& fixture) {
  // All shapes have one child, hence one proxy.
  return *get<members::FixtureProxies>(fixture);
}

bool are_walls(const b2Body& body) {
  if (body.GetType() != b2_staticBody || body.GetJointList() != nullptr) return false;
  for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (f->GetType() != b2Shape::e_edge) return false;
  }
  return body.GetFixtureList() != nullptr;
}

// Returns the objects of a list of Box2D, whose newest object is the first one, oldest first.
template <typename Object>
std::vector<Object*> oldest_first(const Object* newest) {
  std::vector<Object*> objects;
  for (const Object* each = newest; each != nullptr; each = each->GetNext()) {
    objects.push_back(const_cast<Object*>(each));
  }
  std::reverse(objects.begin(), objects.end());
  return objects;
}

// Sets the fixtures of a body, given oldest first.
void set_fixtures(b2Body& body, const std::vector<b2Fixture*>& fixtures) {
  b2Fixture* newest = nullptr;
  for (b2Fixture* fixture : fixtures) {
    get<members::FixtureNext>(*fixture) = newest;
    newest = fixture;
  }
  get<members::BodyFixtures>(body) = newest;
  get<members::BodyFixtureCount>(body) = static_cast<int32>(fixtures.size());
}

// Frees the memory of an edge that is in no list.
void free_fixture(b2Fixture& fixture, b2BlockAllocator& allocator) {
  allocator.Free(&proxy_of(fixture), sizeof(b2FixtureProxy));
  auto* edge = static_cast<b2EdgeShape*>(fixture.GetShape());
  edge->~b2EdgeShape();
  allocator.Free(edge, sizeof(b2EdgeShape));
  fixture.~b2Fixture();
  allocator.Free(&fixture, sizeof(b2Fixture));
}

// Adds a fixture to the broad phase. The next step does not search for its contacts.
void insert(b2BroadPhase& broad_phase, b2Fixture& fixture) {
  auto& tree = get<members::BroadPhaseTree>(broad_phase);
  b2FixtureProxy& proxy = proxy_of(fixture);
  proxy.proxyId = tree.CreateProxy(proxy.aabb, &proxy);
  tree.ClearMoved(proxy.proxyId);
  ++get<members::BroadPhaseProxyCount>(broad_phase);
}

// Makes the next step search for contacts of a body.
void touch(b2World& world, b2Body& body) {
  for (b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    broad_phase_of(world).TouchProxy(proxy_of(*f).proxyId);
  }
  get<members::WorldNewContacts>(world) = true;
}

// Replaces the broad phase by one without the walls, with as many nodes as necessary.
void rebuild_broad_phase(b2World& world) {
  b2BroadPhase& broad_phase = broad_phase_of(world);
  broad_phase.~b2BroadPhase();
  new (&broad_phase) b2BroadPhase();
  for (b2Body* body : oldest_first(world.GetBodyList())) {
    if (has_shared_walls(*body)) continue;
    for (b2Fixture* fixture : oldest_first(body->GetFixtureList())) {
      b2FixtureProxy& proxy = proxy_of(*fixture);
      proxy.proxyId = broad_phase.CreateProxy(proxy.aabb, &proxy);
    }
  }
  get<members::WorldNewContacts>(world) = true;
}

// Returns the box of a body in the broad phase. The body must have fixtures.
b2AABB box_of(const b2Body& body, const b2BroadPhase& broad_phase) {
  const b2Fixture* fixture = body.GetFixtureList();
  b2AABB box = broad_phase.GetFatAABB(proxy_of(*fixture).proxyId);
  for (; fixture != nullptr; fixture = fixture->GetNext()) {
    box.Combine(broad_phase.GetFatAABB(proxy_of(*fixture).proxyId));
  }
  return box;
}

// Calls visit(body) for the dynamic bodies with fixtures.
template <typename Visit>
void for_each_dynamic(b2World& world, Visit&& visit) {
  for (b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (body->GetType() == b2_dynamicBody && body->GetFixtureList() != nullptr) visit(*body);
  }
}

// Returns an upper bound of the speed of all points of a body without contacts [m/s].
float speed_of(const b2Body& body, const b2AABB& box, float dt) {
  const float reach = (box.upperBound - box.lowerBound).Length();
  const float force = get<members::BodyForce>(body).Length();
  const float linear =
      body.GetLinearVelocity().Length() + dt * get<members::BodyInverseMass>(body) * force;
  const float angular =
      b2Abs(body.GetAngularVelocity()) +
      dt * get<members::BodyInverseInertia>(body) * b2Abs(get<members::BodyTorque>(body));
  return linear + reach * angular;
}

}  // namespace

b2Fixture* duplicate_fixture(const b2Fixture& fixture, b2Body& body, b2BlockAllocator& allocator) {
  auto* copy = new (allocator.Allocate(sizeof(b2Fixture))) b2Fixture(fixture);
  get<members::FixtureNext>(*copy) = nullptr;
  get<members::FixtureBody>(*copy) = &body;
  get<members::FixtureShape>(*copy) = fixture.GetShape()->Clone(&allocator);
  auto* proxy = new (allocator.Allocate(sizeof(b2FixtureProxy))) b2FixtureProxy(proxy_of(fixture));
  proxy->fixture = copy;
  get<members::FixtureProxies>(*copy) = proxy;
  return copy;
}

Engine make_engine() { return Engine(new b2World(b2Vec2(0.0F, 0.0F))); }

void EngineDeleter::operator()(b2World* engine) const {
  for (b2Body* body = engine->GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (has_shared_walls(*body)) get<members::BodyFixtures>(*body) = nullptr;
  }
  delete engine;
}

SharedWalls::SharedWalls(const b2World& world) {
  for (const b2Body* body : oldest_first(world.GetBodyList())) {
    if (are_walls(*body)) copy_body(*body);
  }
  for (std::size_t i = 0; i < fixtures_.size(); ++i) indices_[id_of(fixtures_[i])] = i;
  make_grid();
}

void SharedWalls::copy_body(const b2Body& body) {
  b2BodyDef definition;
  definition.position = body.GetPosition();
  definition.angle = body.GetAngle();
  definition.userData = const_cast<b2Body&>(body).GetUserData();
  b2Body* copy = engine_.CreateBody(&definition);
  std::vector<b2Fixture*> fixtures;
  for (const b2Fixture* fixture : oldest_first(body.GetFixtureList())) {
    fixtures.push_back(duplicate_fixture(*fixture, *copy, get<members::WorldAllocator>(engine_)));
    insert(broad_phase_of(engine_), *fixtures.back());
  }
  set_fixtures(*copy, fixtures);
  fixtures_.insert(fixtures_.end(), fixtures.begin(), fixtures.end());
}

void SharedWalls::make_grid() {
  if (fixtures_.empty()) return;
  const b2BroadPhase& broad_phase = broad_phase_of(engine_);
  const auto box_at = [&](std::size_t i) -> const b2AABB& {
    return broad_phase.GetFatAABB(proxy_of(*fixtures_[i]).proxyId);
  };
  b2AABB bounds = box_at(0);
  for (std::size_t i = 0; i < fixtures_.size(); ++i) bounds.Combine(box_at(i));
  const b2Vec2 size = bounds.upperBound - bounds.lowerBound;
  origin_ = bounds.lowerBound;
  cell_size_ = std::max(kCellSize, std::max(size.x, size.y) / kMostCells);
  columns_ = static_cast<std::size_t>(size.x / cell_size_) + 1;
  rows_ = static_cast<std::size_t>(size.y / cell_size_) + 1;
  std::vector<std::vector<std::size_t>> walls(cell_count());
  for (std::size_t i = 0; i < fixtures_.size(); ++i) {
    for_each_cell(box_at(i), [&](std::size_t cell) { walls[cell].push_back(i); });
  }
  starts_.push_back(0);
  for (const std::vector<std::size_t>& each : walls) {
    members_.insert(members_.end(), each.begin(), each.end());
    starts_.push_back(members_.size());
  }
}

SharedWalls::Range SharedWalls::cells(float low, float high, std::size_t count) const {
  const float end = static_cast<float>(count) * cell_size_;
  if (!(low < end && high >= 0.0F)) return {0, 0};
  const auto index = [&](float distance) {
    return std::min(static_cast<std::size_t>(distance / cell_size_), count - 1);
  };
  return {index(std::max(low, 0.0F)), index(std::min(high, end)) + 1};
}

const b2Body* SharedWalls::find_body(Id id) const {
  for (const b2Body* body = engine_.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (id_of(body) == id) return body;
  }
  return nullptr;
}

std::optional<std::size_t> SharedWalls::index_of(const b2Fixture& fixture) const {
  const auto found = indices_.find(id_of(&fixture));
  if (found == indices_.end()) return std::nullopt;
  return found->second;
}

NearWalls::NearWalls(const NearWalls& source, b2World& copy)
    : shared_(source.shared_), is_complete_(source.is_complete_) {
  if (shared_ == nullptr) return;
  for (b2Body* body = copy.GetBodyList(); body != nullptr; body = body->GetNext()) {
    if (has_shared_walls(*body)) bodies_[id_of(body)] = body;
  }
  for (const auto& [index, fixture] : source.near_) {
    b2Body& body = *bodies_.at(id_of(fixture->GetBody()));
    near_[index] = duplicate_fixture(*fixture, body, get<members::WorldAllocator>(copy));
  }
}

bool NearWalls::has_invalid_body() const {
  return std::any_of(bodies_.begin(), bodies_.end(),
                     [](const auto& each) { return !is_finite(each.second); });
}

void NearWalls::share(b2World& world) {
  auto shared = std::make_shared<const SharedWalls>(world);
  if (shared->fixtures().empty()) return;
  auto& manager = const_cast<b2ContactManager&>(world.GetContactManager());
  for (b2Contact *contact = world.GetContactList(), *next = nullptr; contact != nullptr;
       contact = next) {
    next = contact->GetNext();
    const bool is_of_walls = shared->index_of(*contact->GetFixtureA()).has_value() ||
                             shared->index_of(*contact->GetFixtureB()).has_value();
    if (is_of_walls) manager.Destroy(contact);
  }
  for (b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
    const b2Body* walls = shared->find_body(id_of(body));
    if (walls == nullptr) continue;
    for (b2Fixture* fixture : oldest_first(body->GetFixtureList())) {
      free_fixture(*fixture, get<members::WorldAllocator>(world));
    }
    get<members::BodyFixtures>(*body) = const_cast<b2Fixture*>(walls->GetFixtureList());
    bodies_[id_of(body)] = body;
  }
  rebuild_broad_phase(world);
  is_complete_.assign(shared->cell_count(), false);
  shared_ = std::move(shared);
}

std::vector<b2Body*> NearWalls::own(b2World& world) {
  std::unordered_map<b2Body*, std::vector<b2Fixture*>> fixtures;
  for (std::size_t i = 0; i < shared_->fixtures().size(); ++i) {
    if (near_.count(i) == 0) create_one(world, i);
    fixtures[near_[i]->GetBody()].push_back(near_[i]);
  }
  std::vector<b2Body*> bodies;
  for (const auto& [body, of_body] : fixtures) {
    set_fixtures(*body, of_body);
    bodies.push_back(body);
  }
  *this = NearWalls();
  return bodies;
}

void NearWalls::create(b2World& world, float dt) {
  if (shared_ == nullptr) return;
  const b2BroadPhase& broad_phase = broad_phase_of(world);
  float reach = 0.0F;
  if (dt > 0.0F) {
    float speed = 0.0F;
    for (b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
      if (body->GetType() == b2_staticBody || body->GetFixtureList() == nullptr) continue;
      speed = b2Max(speed, speed_of(*body, box_of(*body, broad_phase), dt));
    }
    // Contacts make bodies at most twice as fast; see StepGuard. The broad phase extends the boxes
    // of bodies by multiples of their displacements.
    const float displacement = b2Min(2.0F * dt * speed, b2_maxTranslation);
    reach = kMargin + b2_aabbExtension + (1.0F + b2_aabbMultiplier) * displacement;
  }
  const b2Vec2 margin(reach, reach);
  std::vector<b2AABB> created;
  const auto create_in = [&](std::size_t cell) {
    if (is_complete_[cell]) return;
    is_complete_[cell] = true;
    shared_->for_each_in(cell, [&](std::size_t index) {
      if (near_.count(index) != 0) return;
      created.push_back(broad_phase.GetFatAABB(proxy_of(create_one(world, index)).proxyId));
    });
  };
  for_each_dynamic(world, [&](b2Body& body) {
    const b2AABB box = box_of(body, broad_phase);
    shared_->for_each_cell({box.lowerBound - margin, box.upperBound + margin}, create_in);
  });
  if (created.empty()) return;
  for_each_dynamic(world, [&](b2Body& body) {
    const b2AABB box = box_of(body, broad_phase);
    const auto overlaps = [&](const b2AABB& wall) { return b2TestOverlap(box, wall); };
    if (std::any_of(created.begin(), created.end(), overlaps)) touch(world, body);
  });
}

void NearWalls::destroy(b2World& world) const {
  for (const auto& [index, fixture] : near_) {
    free_fixture(*fixture, get<members::WorldAllocator>(world));
  }
}

b2Fixture* NearWalls::find(const b2Fixture& fixture) const {
  if (shared_ == nullptr) return nullptr;
  const std::optional<std::size_t> index = shared_->index_of(fixture);
  if (!index) return nullptr;
  const auto found = near_.find(*index);
  return found == near_.end() ? nullptr : found->second;
}

const b2Fixture& NearWalls::create_one(b2World& world, std::size_t index) {
  const b2Fixture& fixture = *shared_->fixtures()[index];
  b2Body& body = *bodies_.at(id_of(fixture.GetBody()));
  b2Fixture* own = duplicate_fixture(fixture, body, get<members::WorldAllocator>(world));
  near_[index] = own;
  insert(broad_phase_of(world), *own);
  return *own;
}

}  // namespace flatland
