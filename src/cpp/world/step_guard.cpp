#include "world/step_guard.h"

#include <box2d/b2_contact.h>
#include <box2d/b2_fixture.h>
#include <box2d/b2_time_step.h>
#include <box2d/b2_weld_joint.h>
#include <box2d/b2_world.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "world/bodies.h"
#include "world/contacts.h"

namespace flatland {
namespace {

// The number of times that the handling of impacts may update one contact in a step. The contact of
// a body with room to move is updated three times at most. A contact that is updated more often
// would be updated until Box2D reaches its own limit. The first steps of a jam have a greater
// limit, so that overlapping bodies can be pushed apart.
constexpr int kMostUpdates = 6;
constexpr int kMostUpdatesAtFirst = 20;
constexpr std::uint64_t kFirstSteps = 10;
// In a lasting jam, impacts at touching contacts have no effect, and each of them updates all
// contacts of the body. Every few steps they are handled, which shows whether there is room again.
constexpr std::uint64_t kStepsBetweenTrials = 20;

// Limits of the gain of speed in a step. Contacts cannot add energy, but the solver is approximate.
// A body or a group of bodies that gains more speed is jammed.
constexpr double kGainAlone = 1.01;
constexpr double kSlackAlone = 0.01;  // m/s
constexpr double kGainOfGroup = 2.0;
constexpr double kSlackOfGroup = 0.1;  // m/s

bool is_dynamic(const b2Body* body) { return body->GetType() == b2_dynamicBody; }

// Returns the kinetic energy [J] of a body whose velocity is increased by speeds [m/s, rad/s].
double energy_of(const b2Body* body, float speed = 0.0F, float spin = 0.0F) {
  const double v = static_cast<double>(body->GetLinearVelocity().Length() + speed);
  const double w = static_cast<double>(std::abs(body->GetAngularVelocity()) + spin);
  return 0.5 * (static_cast<double>(body->GetMass()) * v * v +
                static_cast<double>(inertia_about_center<float>(*body)) * w * w);
}

// Removes the impulses that Box2D stores for the warm start of the next step.
void forget_impulses(b2Contact* contact) {
  b2Manifold* manifold = contact->GetManifold();
  for (int32 i = 0; i < manifold->pointCount; ++i) {
    manifold->points[i].normalImpulse = 0.0F;
    manifold->points[i].tangentImpulse = 0.0F;
  }
}

// Returns the energy that the spring of a weld joint can release [J]; 0 for other joints.
double spring_energy(const b2Joint* joint) {
  if (joint->GetType() != e_weldJoint) return 0.0;
  const auto* weld = static_cast<const b2WeldJoint*>(joint);
  const auto turned = static_cast<double>(const_cast<b2Joint*>(joint)->GetBodyB()->GetAngle() -
                                          const_cast<b2Joint*>(joint)->GetBodyA()->GetAngle() -
                                          weld->GetReferenceAngle());
  return 0.5 * static_cast<double>(weld->GetStiffness()) * turned * turned;
}

// Returns an upper bound of the speed of the surface of a kinematic body at another body [m/s].
double surface_speed(const b2Body* kinematic, const b2Body* other) {
  float reach = (other->GetWorldCenter() - kinematic->GetWorldCenter()).Length();
  for (const b2Fixture* f = other->GetFixtureList(); f != nullptr; f = f->GetNext()) {
    reach += f->GetAABB(0).GetPerimeter();
  }
  return static_cast<double>(kinematic->GetLinearVelocity().Length() +
                             std::abs(kinematic->GetAngularVelocity()) * reach);
}

}  // namespace

bool is_finite(const b2Body* body) {
  // The sum is finite only if all terms are finite.
  const b2Vec2& center = body->GetWorldCenter();
  const b2Vec2& velocity = body->GetLinearVelocity();
  return std::isfinite(center.x + center.y + body->GetAngle() + velocity.x + velocity.y +
                       body->GetAngularVelocity());
}

StepGuard::Start& StepGuard::start_of(const b2Body* body) { return starts_[slot_of(id_of(body))]; }

StepGuard::Start& StepGuard::make_start(Id body) {
  const std::uint32_t slot = slot_of(body);
  if (slot >= starts_.size()) starts_.resize(slot + 1);
  Start& start = starts_[slot];
  if (start.body != body) {
    start = Start();
    start.body = body;
  }
  return start;
}

void StepGuard::add_acceleration(Id body, float linear, float angular) {
  Start& start = make_start(body);
  start.acceleration += linear;
  start.angular_acceleration += angular;
  has_accelerations_ = true;
}

void StepGuard::begin(const b2World& world, const BodiesByType& bodies, float dt) {
  world_ = &world;
  ++step_;
  failed_ = false;
  updates_.clear();
  float mass = 0.0F;
  for (const b2Body* body : bodies.dynamic) {
    Start& start = make_start(id_of(body));
    if (start.last_jam + 1 != step_) start.jammed_steps = 0;
    mass += body->GetMass();
    // This step starts from impulses of the previous step, whose energy is therefore allowed, too.
    const double earlier = start.energy;
    start.energy = energy_of(body, dt * start.acceleration, dt * start.angular_acceleration);
    start.allowed = std::max(start.energy, earlier);
  }
  for (const b2Body* body : bodies.fixed) {
    Start& start = make_start(id_of(body));
    start.position = body->GetPosition();
    start.angle = body->GetAngle();
  }
  // This impulse accelerates all bodies together to the largest speed of Box2D.
  largest_impulse_ = mass * b2_maxTranslation / dt;
  // Box2D writes these times after the update of all contacts, and before the handling of impacts.
  auto& profile = const_cast<b2Profile&>(world.GetProfile());
  profile.collide = profile.solve = -1.0F;
}

void StepGuard::pre_solve(b2Contact* contact) noexcept {
  b2Manifold* manifold = contact->GetManifold();
  for (int32 i = 0; i < manifold->pointCount; ++i) {
    const b2ManifoldPoint& point = manifold->points[i];
    // The comparisons are written so that NaN is too large.
    if (!(point.normalImpulse <= largest_impulse_ &&
          std::abs(point.tangentImpulse) <= largest_impulse_)) {
      forget_impulses(contact);
    }
  }
  const bool handles_impacts = world_->GetProfile().collide >= 0.0F;
  if (!handles_impacts || failed_) return;
  try {
    const int updates = ++updates_[contact];
    if (updates <= kMostUpdates) return;
    limit_bodies(contact);
    if (jammed_steps(contact) < kFirstSteps && updates <= kMostUpdatesAtFirst) return;
    // The contact has no effect until the next step, which updates all contacts.
    contact->SetEnabled(false);
  } catch (const std::exception&) {
    failed_ = true;
  }
}

void StepGuard::post_solve(b2Contact* contact) noexcept {
  if (world_->GetProfile().solve >= 0.0F) return;  // an impact
  const std::uint64_t steps = jammed_steps(contact);
  if (steps < kFirstSteps || steps % kStepsBetweenTrials == 0 || failed_) return;
  try {
    limit_bodies(contact);
    contact->SetEnabled(false);
  } catch (const std::exception&) {
    failed_ = true;
  }
}

std::uint64_t StepGuard::jammed_steps(b2Contact* contact) {
  const auto steps_of = [this](const b2Fixture* fixture) {
    const b2Body* body = fixture->GetBody();
    return is_dynamic(body) ? start_of(body).jammed_steps : 0;
  };
  return std::max(steps_of(contact->GetFixtureA()), steps_of(contact->GetFixtureB()));
}

void StepGuard::limit_bodies(b2Contact* contact) {
  limit(contact->GetFixtureA()->GetBody());
  limit(contact->GetFixtureB()->GetBody());
}

void StepGuard::limit(b2Body* body) {
  if (is_dynamic(body) && std::find(limited_.begin(), limited_.end(), body) == limited_.end()) {
    limited_.push_back(body);
  }
}

StepReport StepGuard::end(const BodiesByType& bodies) {
  StepReport report;
  for (b2Body* body : bodies.dynamic) {
    if (!is_finite(body)) {
      report.invalid.push_back(id_of(body));
      continue;
    }
    const Start& start = start_of(body);
    const bool is_faster = energy_of(body) > start.allowed * kGainAlone * kGainAlone;
    if (is_faster && start.step != step_) examine_group(body);
  }
  for (const b2Body* body : bodies.kinematic) {
    // A body that sleeps, or coasts within its boxes, remains valid.
    if (body->IsAwake() && !is_finite(body)) report.invalid.push_back(id_of(body));
  }
  for (b2Body* body : bodies.fixed) {
    if (!is_finite(body)) restore_static(body);
  }
  for (const b2Body* body : limited_) {
    report.limited.push_back(id_of(body));
    Start& start = start_of(body);
    start.jammed_steps = start.last_jam + 1 == step_ ? start.jammed_steps + 1 : 1;
    start.last_jam = step_;
  }
  limited_.clear();
  if (has_accelerations_) {
    for (Start& start : starts_) start.acceleration = start.angular_acceleration = 0.0F;
    has_accelerations_ = false;
  }
  return report;
}

void StepGuard::examine_group(b2Body* first) {
  // The group contains all bodies that can exchange energy in this step, by contacts or joints.
  group_.assign(1, first);
  start_of(first).step = step_;
  const auto add = [&](b2Body* body) {
    if (!is_dynamic(body) || start_of(body).step == step_) return;
    start_of(body).step = step_;
    group_.push_back(body);
  };
  double before = 0.0;
  double after = 0.0;
  double mass = 0.0;
  double pushing_speed = 0.0;  // greatest speed of surfaces: kinematic bodies, conveyor belts
  double restitution = 1.0;
  bool has_joints = false;
  for (std::size_t i = 0; i < group_.size(); ++i) {
    const b2Body* body = group_[i];
    before += start_of(body).allowed;
    after += energy_of(body);
    mass += static_cast<double>(body->GetMass());
    for (const b2ContactEdge* edge = body->GetContactList(); edge != nullptr; edge = edge->next) {
      b2Contact* contact = edge->contact;
      restitution = std::max(restitution, static_cast<double>(contact->GetRestitution()));
      pushing_speed =
          std::max(pushing_speed, static_cast<double>(std::abs(contact->GetTangentSpeed())));
      if (edge->other->GetType() == b2_kinematicBody) {
        pushing_speed = std::max(pushing_speed, surface_speed(edge->other, body));
      }
      if (contact->IsTouching()) add(edge->other);
    }
    for (const b2JointEdge* edge = body->GetJointList(); edge != nullptr; edge = edge->next) {
      has_joints = true;
      before += 0.5 * spring_energy(edge->joint);  // both bodies have this joint
      if (edge->other->GetType() == b2_kinematicBody) {
        pushing_speed = std::max(pushing_speed, surface_speed(edge->other, body));
      }
      add(edge->other);
    }
  }
  const bool is_alone = group_.size() == 1 && !has_joints;
  const double allowed = restitution * (std::sqrt(2.0 * before / mass) + 2.0 * pushing_speed);
  const double speed = std::sqrt(2.0 * after / mass);
  const double most =
      is_alone ? kGainAlone * allowed + kSlackAlone : kGainOfGroup * allowed + kSlackOfGroup;
  if (speed <= most || !std::isfinite(speed)) return;
  const auto ratio = static_cast<float>(allowed / speed);
  for (b2Body* body : group_) {
    body->SetLinearVelocity(ratio * body->GetLinearVelocity());
    body->SetAngularVelocity(ratio * body->GetAngularVelocity());
    for (const b2ContactEdge* edge = body->GetContactList(); edge != nullptr; edge = edge->next) {
      forget_impulses(edge->contact);
    }
    limit(body);
  }
}

void StepGuard::restore_static(b2Body* body) {
  // Box2D sets the velocity of a body to zero only when the body becomes static.
  body->SetType(b2_kinematicBody);
  body->SetType(b2_staticBody);
  const Start& start = start_of(body);
  body->SetTransform(start.position, start.angle);
}

}  // namespace flatland
