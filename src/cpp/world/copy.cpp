// Exact copies of worlds: `World::become_copy_of`.
//
// The results of Box2D depend on the order of bodies, fixtures, joints and contacts in lists, on
// the nodes of the broad phase and on the impulses of the last step. In all lists of Box2D, the
// newest object is the first one, and the removal of an object does not change the order of the
// others. The contacts of a body, for example, have the same order as in the list of the world.
// Each list is therefore copied from the front, and the lists of the bodies in the order of the
// lists of the world. No result depends on addresses.
//
// A world that is restored again and again has the objects of the source already: as long as its
// structure is that of the source, only what moves is copied.
#include <box2d/b2_circle_shape.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_polygon_shape.h>
#include <box2d/b2_revolute_joint.h>
#include <box2d/b2_weld_joint.h>

#include <algorithm>
#include <memory>
#include <new>
#include <unordered_map>
#include <vector>

#include "world/box2d_members.h"
#include "world/broad_phase.h"
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
  EngineCopier(const b2World& source, const NearWalls& walls, b2World& target, Bodies& bodies,
               Fixtures& fixtures, Joints& joints)
      : source_(source),
        source_walls_(walls),
        target_(target),
        allocator_(get<members::WorldAllocator>(target)),
        bodies_(bodies),
        fixtures_(fixtures),
        joints_(joints) {}

  void copy() {
    copy_bodies();
    walls_ = NearWalls(source_walls_, target_);
    copy_joints();
    copy_contacts();
    copy_broad_phase();
    set_proxies();
    copy_times();
  }

  b2Body* copy_of(const b2Body* body) { return *bodies_.find(id_of(body)); }
  b2Fixture* copy_of(const b2Fixture* fixture) {
    b2Fixture* wall = walls_.find(*fixture);
    return wall != nullptr ? wall : *fixtures_.find(id_of(fixture));
  }
  // The walls of the copy.
  NearWalls take_walls() { return std::move(walls_); }
  const std::unordered_map<const b2Contact*, const b2Contact*>& contacts() const {
    return contacts_;
  }

  // Whether the array of the broad phase is large enough.
  bool can_revert() const {
    return UsedNodes(tree_of(source_)).count <= get<members::TreeCapacity>(tree_of(target_));
  }

  // The same as `copy`, in two parts, for a target with the structure of the source. The second
  // part cannot fail.
  void begin_revert() {
    is_revert_ = true;
    walls_ = NearWalls(source_walls_, target_);
    create_contacts();
  }
  void revert() {
    destroy_contacts();
    revert_bodies();
    revert_joints();
    link_contacts();
    copy_broad_phase();
    set_wall_proxies();
    copy_times();
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
    if (has_shared_walls(body)) {
      *end = const_cast<b2Fixture*>(body.GetFixtureList());
      return;
    }
    for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
      b2Fixture* copy = duplicate_fixture(*f, body_copy, allocator_);
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
    create_contacts();
    link_contacts();
  }

  // Creates copies of the contacts that belong to no list yet.
  void create_contacts() {
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
      contacts_[contact] = copy;
      created_.push_back(copy);
    }
  }

  void link_contacts() {
    auto& manager = const_cast<b2ContactManager&>(target_.GetContactManager());
    b2Contact* last = nullptr;
    Ends<b2ContactEdge> ends;
    for (b2Contact* copy : created_) {
      get<members::ContactPrevious>(*copy) = last;
      get<members::ContactNext>(*copy) = nullptr;
      (last == nullptr ? manager.m_contactList : get<members::ContactNext>(*last)) = copy;
      b2Body* body_a = copy->GetFixtureA()->GetBody();
      b2Body* body_b = copy->GetFixtureB()->GetBody();
      b2ContactEdge& edge_a = get<members::ContactEdgeA>(*copy);
      b2ContactEdge& edge_b = get<members::ContactEdgeB>(*copy);
      edge_a = {body_b, copy, nullptr, nullptr};
      edge_b = {body_a, copy, nullptr, nullptr};
      append(edge_a, get<members::BodyContacts>(*body_a), ends[body_a]);
      append(edge_b, get<members::BodyContacts>(*body_b), ends[body_b]);
      ++manager.m_contactCount;
      last = copy;
    }
  }

  void destroy_contacts() {
    auto& manager = const_cast<b2ContactManager&>(target_.GetContactManager());
    while (b2Contact* contact = manager.m_contactList) {
      manager.m_contactList = contact->GetNext();
      expose(members::ContactDestroyer{})(contact, &allocator_);
    }
    manager.m_contactCount = 0;
  }

  // Replaces the state of all bodies of the target, which has the same bodies.
  void revert_bodies() {
    b2Body* body = target_.GetBodyList();
    for (const b2Body* from = source_.GetBodyList(); from != nullptr; from = from->GetNext()) {
      b2Body* previous = get<members::BodyPrevious>(*body);
      b2Body* next = get<members::BodyNext>(*body);
      b2Fixture* fixtures = get<members::BodyFixtures>(*body);
      b2JointEdge* joints = get<members::BodyJoints>(*body);
      *body = *from;
      get<members::BodyWorld>(*body) = &target_;
      get<members::BodyPrevious>(*body) = previous;
      get<members::BodyNext>(*body) = next;
      get<members::BodyFixtures>(*body) = fixtures;
      get<members::BodyJoints>(*body) = joints;
      get<members::BodyContacts>(*body) = nullptr;
      if (body->GetType() != b2_staticBody) revert_fixtures(*from, *body);
      body = next;
    }
  }

  static void revert_fixtures(const b2Body& from, b2Body& to) {
    const b2Fixture* source = from.GetFixtureList();
    for (b2Fixture* f = to.GetFixtureList(); f != nullptr; f = f->GetNext()) {
      f->SetDensity(source->GetDensity());
      f->SetFriction(source->GetFriction());
      get<members::FixtureProxies>(*f)->aabb = get<members::FixtureProxies>(*source)->aabb;
      source = source->GetNext();
    }
  }

  // Replaces the state of all joints of the target, which has the same joints.
  void revert_joints() {
    b2Joint* joint = target_.GetJointList();
    for (const b2Joint* from = source_.GetJointList(); from != nullptr; from = from->GetNext()) {
      b2Joint* previous = get<members::JointPrevious>(*joint);
      b2Joint* next = get<members::JointNext>(*joint);
      b2Body* body_a = get<members::JointBodyA>(*joint);
      b2Body* body_b = get<members::JointBodyB>(*joint);
      const b2JointEdge edge_a = get<members::JointEdgeA>(*joint);
      const b2JointEdge edge_b = get<members::JointEdgeB>(*joint);
      if (from->GetType() == e_revoluteJoint) {
        static_cast<b2RevoluteJoint&>(*joint) = static_cast<const b2RevoluteJoint&>(*from);
      } else {
        static_cast<b2WeldJoint&>(*joint) = static_cast<const b2WeldJoint&>(*from);
      }
      get<members::JointPrevious>(*joint) = previous;
      get<members::JointNext>(*joint) = next;
      get<members::JointBodyA>(*joint) = body_a;
      get<members::JointBodyB>(*joint) = body_b;
      get<members::JointEdgeA>(*joint) = edge_a;
      get<members::JointEdgeB>(*joint) = edge_b;
      joint = next;
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
    b2BroadPhase& to = broad_phase_of(target_);
    assign<members::BroadPhaseProxyCount>(from, to);
    const int32 moved = get<members::BroadPhaseMovedCount>(from);
    resize(get<members::BroadPhaseMoved>(to), get<members::BroadPhaseMovedCapacity>(to),
           std::max(moved, get<members::BroadPhaseMovedCapacity>(to)));
    std::copy_n(get<members::BroadPhaseMoved>(from), moved, get<members::BroadPhaseMoved>(to));
    get<members::BroadPhaseMovedCount>(to) = moved;
    copy_tree(get<members::BroadPhaseTree>(from), get<members::BroadPhaseTree>(to));
  }

  static const b2DynamicTree& tree_of(const b2World& world) {
    return get<members::BroadPhaseTree>(world.GetContactManager().m_broadPhase);
  }

  // The nodes of a tree without those at the end of its array that were never used: they are the
  // last ones in the list of free nodes, in ascending order. The list of a tree with a larger or
  // smaller array continues in the same way.
  struct UsedNodes {
    explicit UsedNodes(const b2DynamicTree& tree) {
      const b2TreeNode* nodes = get<members::TreeNodes>(tree);
      const int32 capacity = get<members::TreeCapacity>(tree);
      int32 previous = b2_nullNode;
      int32 first = capacity;
      for (int32 i = get<members::TreeFreeList>(tree); i != b2_nullNode; i = nodes[i].next) {
        if (previous == b2_nullNode || i != previous + 1) {
          first = i;
          last_free = previous;
        }
        previous = i;
      }
      if (previous == capacity - 1) {
        count = first;
      } else {
        count = capacity;
        last_free = previous;
      }
    }

    int32 count;
    int32 last_free = b2_nullNode;  // the end of the list of those that are free
  };

  // Free nodes beyond the used ones: a small model can be added without a larger array.
  static constexpr int32 kSpareNodes = 32;

  // Copies all but the proxies of the leaves. A new array is as large as necessary.
  void copy_tree(const b2DynamicTree& from, b2DynamicTree& to) {
    const UsedNodes used(from);
    b2TreeNode*& nodes = get<members::TreeNodes>(to);
    int32& capacity = get<members::TreeCapacity>(to);
    if (!is_revert_) resize(nodes, capacity, used.count + kSpareNodes);
    const b2TreeNode* from_nodes = get<members::TreeNodes>(from);
    for (int32 i = 0; i < used.count; ++i) {
      void* proxy = nodes[i].userData;
      nodes[i] = from_nodes[i];
      nodes[i].userData = proxy;
    }
    for (int32 i = used.count; i < capacity; ++i) {
      nodes[i].next = i + 1 < capacity ? i + 1 : b2_nullNode;
      nodes[i].height = -1;
    }
    assign<members::TreeRoot>(from, to);
    assign<members::TreeNodeCount>(from, to);
    assign<members::TreeFreeList>(from, to);
    const int32 next = used.count < capacity ? used.count : b2_nullNode;
    (used.last_free == b2_nullNode ? get<members::TreeFreeList>(to) : nodes[used.last_free].next) =
        next;
    assign<members::TreeInsertionCount>(from, to);
  }

  void set_proxies() {
    auto& tree = const_cast<b2DynamicTree&>(tree_of(target_));
    b2TreeNode* nodes = get<members::TreeNodes>(tree);
    for (int32 i = 0; i < get<members::TreeCapacity>(tree); ++i) nodes[i].userData = nullptr;
    for (b2Body* body = target_.GetBodyList(); body != nullptr; body = body->GetNext()) {
      if (has_shared_walls(*body)) continue;
      for (b2Fixture* f = body->GetFixtureList(); f != nullptr; f = f->GetNext()) {
        b2FixtureProxy* proxy = get<members::FixtureProxies>(*f);
        nodes[proxy->proxyId].userData = proxy;
      }
    }
    set_wall_proxies();
  }

  void set_wall_proxies() {
    b2TreeNode* nodes = get<members::TreeNodes>(tree_of(target_));
    walls_.for_each([nodes](const b2Fixture& fixture) {
      b2FixtureProxy* proxy = get<members::FixtureProxies>(fixture);
      nodes[proxy->proxyId].userData = proxy;
    });
  }

  void copy_times() {
    assign<members::WorldLastRate>(source_, target_);
    assign<members::WorldNewContacts>(source_, target_);
    assign<members::WorldStepComplete>(source_, target_);
    assign<members::WorldProfile>(source_, target_);
  }

  // Changes the size of an array of Box2D. The contents are lost.
  template <typename Element>
  static void resize(Element*& elements, int32& capacity, int32 size) {
    if (size == capacity) return;
    auto* resized = static_cast<Element*>(b2Alloc(size * static_cast<int32>(sizeof(Element))));
    if (resized == nullptr) throw std::bad_alloc();
    std::uninitialized_value_construct_n(resized, size);
    b2Free(elements);
    elements = resized;
    capacity = size;
  }

  const b2World& source_;
  const NearWalls& source_walls_;
  b2World& target_;
  b2BlockAllocator& allocator_;
  Bodies& bodies_;
  Fixtures& fixtures_;
  Joints& joints_;
  std::unordered_map<const b2Contact*, const b2Contact*> contacts_;
  NearWalls walls_;
  bool is_revert_ = false;
  std::vector<b2Contact*> created_;  // the copies of contacts, in the order of the list
};

}  // namespace

void World::become_copy_of(World& source) {
  source.check_readable();
  check_changeable();
  if (&source == this || revert_to(source)) return;
  Engine engine = make_engine();
  auto bodies = source.bodies_;
  auto fixtures = source.fixtures_;
  auto joints = source.joints_;
  EngineCopier copier(*source.engine_, source.walls_, *engine, bodies, fixtures, joints);
  copier.copy();
  bodies.exclude_ids_of(bodies_);
  fixtures.exclude_ids_of(fixtures_);
  joints.exclude_ids_of(joints_);
  OtherParts parts = copy_others(source, copier.contacts());
  rays_.become_copy_of(
      source.rays_, [&](const b2Body* body) { return copier.copy_of(body); },
      [&](const b2Fixture* fixture) { return copier.copy_of(fixture); });
  // The statements below cannot fail.
  engine_ = std::move(engine);
  walls_ = copier.take_walls();
  bodies_ = std::move(bodies);
  fixtures_ = std::move(fixtures);
  joints_ = std::move(joints);
  structure_ = source.structure_;
  replace_others(source, std::move(parts));
  listen();
}

bool World::revert_to(World& source) {
  if (structure_ != source.structure_) return false;
  EngineCopier copier(*source.engine_, source.walls_, *engine_, bodies_, fixtures_, joints_);
  if (!copier.can_revert()) return false;
  copier.begin_revert();
  OtherParts parts = copy_others(source, copier.contacts());
  // The statements below cannot fail.
  copier.revert();
  walls_.destroy(*engine_);
  walls_ = copier.take_walls();
  replace_others(source, std::move(parts));
  return true;
}

World::OtherParts World::copy_others(const World& source, const ContactCopies& copies) const {
  OtherParts parts{source.contacts_, source.jobs_, source.invalid_};
  parts.contacts.replace_contacts(copies);
  parts.contacts.touches.exclude_ids_of(contacts_.touches);
  parts.jobs.exclude_ids_of(jobs_);
  return parts;
}

void World::replace_others(const World& source, OtherParts parts) {
  contacts_ = std::move(parts.contacts);
  jobs_ = std::move(parts.jobs);
  invalid_ = std::move(parts.invalid);
  last_step_time_ = source.last_step_time_;
  set_time(source.time());
}

void World::clear() {
  check_changeable();
  Engine engine = make_engine();
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
  walls_ = NearWalls();
  bodies_ = std::move(bodies);
  fixtures_ = std::move(fixtures);
  joints_ = std::move(joints);
  contacts_ = std::move(contacts);
  invalid_.clear();
  last_step_time_ = 1.0;
  structure_changed();
  listen();
}

}  // namespace flatland
