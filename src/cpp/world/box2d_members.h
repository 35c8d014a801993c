// Private members of Box2D 2.4, which has no public access to these members. An explicit template
// instantiation may name private members, and the compiler checks their names and types.
//
// `get<Tag>(object)` returns a reference to a member. Only source files may include this header.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_contact.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_joint.h>
#include <box2d/b2_world.h>

namespace flatland::members {
namespace {

template <typename Tag, typename Tag::Pointer pointer>
struct Expose {
  friend typename Tag::Pointer expose(Tag) { return pointer; }
};

#define FLATLAND_EXPOSE(Class, Type, member, Tag) \
  struct Tag {                                    \
    using Pointer = Type Class::*;                \
    friend Pointer expose(Tag);                   \
  };                                              \
  template struct Expose<Tag, &Class::member>

FLATLAND_EXPOSE(b2World, b2BlockAllocator, m_blockAllocator, WorldAllocator);
FLATLAND_EXPOSE(b2World, b2Body*, m_bodyList, WorldBodies);
FLATLAND_EXPOSE(b2World, b2Joint*, m_jointList, WorldJoints);
FLATLAND_EXPOSE(b2World, int32, m_bodyCount, WorldBodyCount);
FLATLAND_EXPOSE(b2World, int32, m_jointCount, WorldJointCount);
FLATLAND_EXPOSE(b2World, float, m_inv_dt0, WorldLastRate);
FLATLAND_EXPOSE(b2World, bool, m_newContacts, WorldNewContacts);
FLATLAND_EXPOSE(b2World, bool, m_stepComplete, WorldStepComplete);
FLATLAND_EXPOSE(b2World, b2Profile, m_profile, WorldProfile);

FLATLAND_EXPOSE(b2Body, b2World*, m_world, BodyWorld);
FLATLAND_EXPOSE(b2Body, b2Body*, m_prev, BodyPrevious);
FLATLAND_EXPOSE(b2Body, b2Body*, m_next, BodyNext);
FLATLAND_EXPOSE(b2Body, b2Fixture*, m_fixtureList, BodyFixtures);
FLATLAND_EXPOSE(b2Body, int32, m_fixtureCount, BodyFixtureCount);
FLATLAND_EXPOSE(b2Body, b2JointEdge*, m_jointList, BodyJoints);
FLATLAND_EXPOSE(b2Body, b2ContactEdge*, m_contactList, BodyContacts);
FLATLAND_EXPOSE(b2Body, b2Transform, m_xf, BodyTransform);
FLATLAND_EXPOSE(b2Body, b2Sweep, m_sweep, BodySweep);
FLATLAND_EXPOSE(b2Body, float, m_sleepTime, BodySleepTime);
FLATLAND_EXPOSE(b2Body, uint16, m_flags, BodyFlags);
FLATLAND_EXPOSE(b2Body, b2Vec2, m_linearVelocity, BodyVelocity);
FLATLAND_EXPOSE(b2Body, float, m_angularVelocity, BodyOmega);
FLATLAND_EXPOSE(b2Body, b2Vec2, m_force, BodyForce);
FLATLAND_EXPOSE(b2Body, float, m_torque, BodyTorque);
FLATLAND_EXPOSE(b2Body, float, m_invMass, BodyInverseMass);
FLATLAND_EXPOSE(b2Body, float, m_invI, BodyInverseInertia);

FLATLAND_EXPOSE(b2Fixture, b2Fixture*, m_next, FixtureNext);
FLATLAND_EXPOSE(b2Fixture, b2Body*, m_body, FixtureBody);
FLATLAND_EXPOSE(b2Fixture, b2Shape*, m_shape, FixtureShape);
FLATLAND_EXPOSE(b2Fixture, b2FixtureProxy*, m_proxies, FixtureProxies);
FLATLAND_EXPOSE(b2Fixture, int32, m_proxyCount, FixtureProxyCount);

FLATLAND_EXPOSE(b2Joint, b2Joint*, m_prev, JointPrevious);
FLATLAND_EXPOSE(b2Joint, b2Joint*, m_next, JointNext);
FLATLAND_EXPOSE(b2Joint, b2JointEdge, m_edgeA, JointEdgeA);
FLATLAND_EXPOSE(b2Joint, b2JointEdge, m_edgeB, JointEdgeB);
FLATLAND_EXPOSE(b2Joint, b2Body*, m_bodyA, JointBodyA);
FLATLAND_EXPOSE(b2Joint, b2Body*, m_bodyB, JointBodyB);

FLATLAND_EXPOSE(b2Contact, uint32, m_flags, ContactFlags);
FLATLAND_EXPOSE(b2Contact, b2Contact*, m_prev, ContactPrevious);
FLATLAND_EXPOSE(b2Contact, b2Contact*, m_next, ContactNext);
FLATLAND_EXPOSE(b2Contact, b2ContactEdge, m_nodeA, ContactEdgeA);
FLATLAND_EXPOSE(b2Contact, b2ContactEdge, m_nodeB, ContactEdgeB);
FLATLAND_EXPOSE(b2Contact, b2Fixture*, m_fixtureA, ContactFixtureA);
FLATLAND_EXPOSE(b2Contact, b2Fixture*, m_fixtureB, ContactFixtureB);

FLATLAND_EXPOSE(b2BroadPhase, b2DynamicTree, m_tree, BroadPhaseTree);
FLATLAND_EXPOSE(b2BroadPhase, int32, m_proxyCount, BroadPhaseProxyCount);
FLATLAND_EXPOSE(b2BroadPhase, int32*, m_moveBuffer, BroadPhaseMoved);
FLATLAND_EXPOSE(b2BroadPhase, int32, m_moveCapacity, BroadPhaseMovedCapacity);
FLATLAND_EXPOSE(b2BroadPhase, int32, m_moveCount, BroadPhaseMovedCount);

FLATLAND_EXPOSE(b2DynamicTree, int32, m_root, TreeRoot);
FLATLAND_EXPOSE(b2DynamicTree, b2TreeNode*, m_nodes, TreeNodes);
FLATLAND_EXPOSE(b2DynamicTree, int32, m_nodeCount, TreeNodeCount);
FLATLAND_EXPOSE(b2DynamicTree, int32, m_nodeCapacity, TreeCapacity);
FLATLAND_EXPOSE(b2DynamicTree, int32, m_freeList, TreeFreeList);
FLATLAND_EXPOSE(b2DynamicTree, int32, m_insertionCount, TreeInsertionCount);

#undef FLATLAND_EXPOSE

// Creates the contact of two fixtures without adding it to any list.
struct ContactFactory {
  using Pointer = b2Contact* (*)(b2Fixture*, int32, b2Fixture*, int32, b2BlockAllocator*);
  friend Pointer expose(ContactFactory);
};
template struct Expose<ContactFactory, &b2Contact::Create>;

// Destroys a contact that is in no list.
struct ContactDestroyer {
  using Pointer = void (*)(b2Contact*, b2BlockAllocator*);
  friend Pointer expose(ContactDestroyer);
};
template struct Expose<ContactDestroyer, &b2Contact::Destroy>;

// `expose(Tag{})` returns a private constant.
#define FLATLAND_EXPOSE_FLAG(Class, flag, Tag) \
  struct Tag {                                 \
    using Pointer = int;                       \
    friend Pointer expose(Tag);                \
  };                                           \
  template struct Expose<Tag, Class::flag>

FLATLAND_EXPOSE_FLAG(b2Body, e_awakeFlag, BodyAwakeFlag);
FLATLAND_EXPOSE_FLAG(b2Contact, e_filterFlag, ContactFilterFlag);

#undef FLATLAND_EXPOSE_FLAG

template <typename Tag, typename Object>
auto& get(Object& object) {
  return object.*expose(Tag{});
}

template <typename Tag, typename From, typename To>
void assign(const From& from, To& to) {
  get<Tag>(to) = get<Tag>(from);
}

}  // namespace
}  // namespace flatland::members
