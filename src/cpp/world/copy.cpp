// Exact copies of worlds: `World::become_copy_of`.
//
// The results of Box2D depend on the order of bodies, fixtures, joints and contacts in lists, on
// the nodes of the broad phase and on the impulses of the last step. In all lists of Box2D, the
// newest object is the first one, and the removal of an object does not change the order of the
// others. The contacts of a body, for example, have the same order as in the list of the world.
// Each list is therefore copied from the front, and the lists of the bodies in the order of the
// lists of the world. No result depends on addresses.
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_polygon_shape.h>
#include <box2d/b2_revolute_joint.h>
#include <box2d/b2_weld_joint.h>

#include <algorithm>
#include <new>
#include <unordered_map>

#include "world/box2d_members.h"
#include "world/errors.h"
#include "world/world.h"

namespace flatland {
namespace {

using members::assign;
using members::get;

// Copies the objects of one Box2D world to another, empty world.
class EngineCopier {
 public:
  using Bodies = SlotMap<b2Body*, IdKind::kBody>;
  using Fixtures = SlotMap<b2Fixture*, IdKind::kFixture>;
  using Joints = SlotMap<JointRecord, IdKind::kJoint>;

  // The maps of ids are copies of the maps of the source, in which the values are replaced.
  EngineCopier(const b2World& source, b2World& target, Bodies& bodies, Fixtures& fixtures,
               Joints& joints)
      : source_(source),
        target_(target),
        allocator_(get<members::WorldAllocator>(target)),
        bodies_(bodies),
        fixtures_(fixtures),
        joints_(joints) {}

  void copy() {
    copy_bodies();
    copy_joints();
    copy_contacts();
    copy_broad_phase();
    assign<members::WorldLastRate>(source_, target_);
    assign<members::WorldNewContacts>(source_, target_);
    assign<members::WorldStepComplete>(source_, target_);
    assign<members::WorldProfile>(source_, target_);
  }

  b2Body* copy_of(const b2Body* body) { return *bodies_.find(id_of(body)); }
  b2Fixture* copy_of(const b2Fixture* fixture) { return *fixtures_.find(id_of(fixture)); }
  const std::unordered_map<const b2Contact*, const b2Contact*>& contacts() const {
    return contacts_;
  }

 private:
  // Returns a copy in memory that the target world owns.
  template <typename Object>
  Object* duplicate(const Object& object) {
    return new (allocator_.Allocate(sizeof(Object))) Object(object);
  }

  void copy_bodies() {
    b2Body* last = nullptr;
    for (const b2Body* body = source_.GetBodyList(); body != nullptr; body = body->GetNext()) {
      b2Body* copy = duplicate(*body);
      get<members::BodyWorld>(*copy) = &target_;
      get<members::BodyPrevious>(*copy) = last;
      get<members::BodyNext>(*copy) = nullptr;
      (last == nullptr ? get<members::WorldBodies>(target_) : get<members::BodyNext>(*last)) = copy;
      get<members::BodyFixtures>(*copy) = nullptr;
      get<members::BodyJoints>(*copy) = nullptr;
      get<members::BodyContacts>(*copy) = nullptr;
      ++get<members::WorldBodyCount>(target_);
      *bodies_.find(id_of(body)) = copy;
      copy_fixtures(*body, *copy);
      last = copy;
    }
  }

  void copy_fixtures(const b2Body& body, b2Body& body_copy) {
    b2Fixture** end = &get<members::BodyFixtures>(body_copy);
    for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
      b2Fixture* copy = duplicate(*f);
      get<members::FixtureNext>(*copy) = nullptr;
      get<members::FixtureBody>(*copy) = &body_copy;
      get<members::FixtureShape>(*copy) = f->GetShape()->Clone(&allocator_);
      // All shapes have one child, hence one proxy.
      b2FixtureProxy* proxy = duplicate(get<members::FixtureProxies>(*f)[0]);
      proxy->fixture = copy;
      get<members::FixtureProxies>(*copy) = proxy;
      *end = copy;
      end = &get<members::FixtureNext>(*copy);
      *fixtures_.find(id_of(f)) = copy;
    }
  }

  void copy_joints() {
    b2Joint* last = nullptr;
    Ends<b2JointEdge> ends;
    for (const b2Joint* joint = source_.GetJointList(); joint != nullptr;
         joint = joint->GetNext()) {
      b2Joint* copy = duplicate_joint(*joint);
      get<members::JointPrevious>(*copy) = last;
      get<members::JointNext>(*copy) = nullptr;
      (last == nullptr ? get<members::WorldJoints>(target_) : get<members::JointNext>(*last)) =
          copy;
      b2Body* body_a = copy_of(get<members::JointBodyA>(*joint));
      b2Body* body_b = copy_of(get<members::JointBodyB>(*joint));
      get<members::JointBodyA>(*copy) = body_a;
      get<members::JointBodyB>(*copy) = body_b;
      b2JointEdge& edge_a = get<members::JointEdgeA>(*copy);
      b2JointEdge& edge_b = get<members::JointEdgeB>(*copy);
      edge_a = {body_b, copy, nullptr, nullptr};
      edge_b = {body_a, copy, nullptr, nullptr};
      append(edge_a, get<members::BodyJoints>(*body_a), ends[body_a]);
      append(edge_b, get<members::BodyJoints>(*body_b), ends[body_b]);
      ++get<members::WorldJointCount>(target_);
      joints_.find(copy->GetUserData().pointer)->joint = copy;
      last = copy;
    }
  }

  b2Joint* duplicate_joint(const b2Joint& joint) {
    if (joint.GetType() == e_revoluteJoint) {
      return duplicate(static_cast<const b2RevoluteJoint&>(joint));
    }
    return duplicate(static_cast<const b2WeldJoint&>(joint));
  }

  void copy_contacts() {
    auto& manager = const_cast<b2ContactManager&>(target_.GetContactManager());
    b2Contact* last = nullptr;
    Ends<b2ContactEdge> ends;
    for (const b2Contact* contact = source_.GetContactList(); contact != nullptr;
         contact = contact->GetNext()) {
      b2Fixture* fixture_a = copy_of(contact->GetFixtureA());
      b2Fixture* fixture_b = copy_of(contact->GetFixtureB());
      // The fixtures of a contact are already in the order of its class.
      b2Contact* copy = expose(members::ContactFactory{})(
          fixture_a, contact->GetChildIndexA(), fixture_b, contact->GetChildIndexB(), &allocator_);
      *copy = *contact;
      get<members::ContactFixtureA>(*copy) = fixture_a;
      get<members::ContactFixtureB>(*copy) = fixture_b;
      get<members::ContactPrevious>(*copy) = last;
      get<members::ContactNext>(*copy) = nullptr;
      (last == nullptr ? manager.m_contactList : get<members::ContactNext>(*last)) = copy;
      b2Body* body_a = fixture_a->GetBody();
      b2Body* body_b = fixture_b->GetBody();
      b2ContactEdge& edge_a = get<members::ContactEdgeA>(*copy);
      b2ContactEdge& edge_b = get<members::ContactEdgeB>(*copy);
      edge_a = {body_b, copy, nullptr, nullptr};
      edge_b = {body_a, copy, nullptr, nullptr};
      append(edge_a, get<members::BodyContacts>(*body_a), ends[body_a]);
      append(edge_b, get<members::BodyContacts>(*body_b), ends[body_b]);
      ++manager.m_contactCount;
      contacts_[contact] = copy;
      last = copy;
    }
  }

  // The last edge in the list of each body.
  template <typename Edge>
  using Ends = std::unordered_map<const b2Body*, Edge*>;

  template <typename Edge>
  static void append(Edge& edge, Edge*& first, Edge*& last) {
    edge.prev = last;
    (last == nullptr ? first : last->next) = &edge;
    last = &edge;
  }

  void copy_broad_phase() {
    const b2BroadPhase& from = source_.GetContactManager().m_broadPhase;
    auto& to = const_cast<b2BroadPhase&>(target_.GetContactManager().m_broadPhase);
    assign<members::BroadPhaseProxyCount>(from, to);
    const int32 moved = get<members::BroadPhaseMovedCount>(from);
    resize(get<members::BroadPhaseMoved>(to), get<members::BroadPhaseMovedCapacity>(to),
           std::max(moved, get<members::BroadPhaseMovedCapacity>(to)));
    std::copy_n(get<members::BroadPhaseMoved>(from), moved, get<members::BroadPhaseMoved>(to));
    get<members::BroadPhaseMovedCount>(to) = moved;
    copy_tree(get<members::BroadPhaseTree>(from), get<members::BroadPhaseTree>(to));
  }

  void copy_tree(const b2DynamicTree& from, b2DynamicTree& to) {
    const int32 capacity = get<members::TreeCapacity>(from);
    b2TreeNode*& nodes = get<members::TreeNodes>(to);
    resize(nodes, get<members::TreeCapacity>(to), capacity);
    std::copy_n(get<members::TreeNodes>(from), capacity, nodes);
    assign<members::TreeRoot>(from, to);
    assign<members::TreeNodeCount>(from, to);
    assign<members::TreeFreeList>(from, to);
    assign<members::TreeInsertionCount>(from, to);
    for (b2Body* body = target_.GetBodyList(); body != nullptr; body = body->GetNext()) {
      for (b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
        b2FixtureProxy* proxy = get<members::FixtureProxies>(*f);
        nodes[proxy->proxyId].userData = proxy;
      }
    }
  }

  // Changes the size of an array of Box2D. The contents are lost.
  template <typename Element>
  static void resize(Element*& elements, int32& capacity, int32 size) {
    if (size == capacity) return;
    auto* resized = static_cast<Element*>(b2Alloc(size * static_cast<int32>(sizeof(Element))));
    if (resized == nullptr) throw std::bad_alloc();
    b2Free(elements);
    elements = resized;
    capacity = size;
  }

  const b2World& source_;
  b2World& target_;
  b2BlockAllocator& allocator_;
  Bodies& bodies_;
  Fixtures& fixtures_;
  Joints& joints_;
  std::unordered_map<const b2Contact*, const b2Contact*> contacts_;
};

}  // namespace

void World::become_copy_of(World& source) {
  source.check_readable();
  check_changeable();
  if (&source == this) return;
  auto engine = std::make_unique<b2World>(b2Vec2(0.0F, 0.0F));
  auto bodies = source.bodies_;
  auto fixtures = source.fixtures_;
  auto joints = source.joints_;
  EngineCopier copier(*source.engine_, *engine, bodies, fixtures, joints);
  copier.copy();
  bodies.exclude_ids_of(bodies_);
  fixtures.exclude_ids_of(fixtures_);
  joints.exclude_ids_of(joints_);
  ContactRecorder contacts = source.contacts_;
  contacts.replace_contacts(copier.contacts());
  contacts.touches.exclude_ids_of(contacts_.touches);
  JobQueue jobs = source.jobs_;
  jobs.exclude_ids_of(jobs_);
  std::vector<Id> invalid = source.invalid_;
  rays_.become_copy_of(
      source.rays_, [&](const b2Body* body) { return copier.copy_of(body); },
      [&](const b2Fixture* fixture) { return copier.copy_of(fixture); });
  // The statements below cannot fail.
  engine_ = std::move(engine);
  bodies_ = std::move(bodies);
  fixtures_ = std::move(fixtures);
  joints_ = std::move(joints);
  contacts_ = std::move(contacts);
  jobs_ = std::move(jobs);
  invalid_ = std::move(invalid);
  last_step_time_ = source.last_step_time_;
  listen();
}

void World::clear() {
  check_changeable();
  auto engine = std::make_unique<b2World>(b2Vec2(0.0F, 0.0F));
  SlotMap<b2Body*, IdKind::kBody> bodies;
  SlotMap<b2Fixture*, IdKind::kFixture> fixtures;
  SlotMap<JointRecord, IdKind::kJoint> joints;
  bodies.exclude_ids_of(bodies_);
  fixtures.exclude_ids_of(fixtures_);
  joints.exclude_ids_of(joints_);
  ContactRecorder contacts;
  contacts.touches.exclude_ids_of(contacts_.touches);
  jobs_.clear();
  rays_.clear();
  engine_ = std::move(engine);
  bodies_ = std::move(bodies);
  fixtures_ = std::move(fixtures);
  joints_ = std::move(joints);
  contacts_ = std::move(contacts);
  invalid_.clear();
  last_step_time_ = 1.0;
  listen();
}

}  // namespace flatland
