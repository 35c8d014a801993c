// Compares flatland::find_new_pairs with b2ContactManager::FindNewContacts on equal random worlds.
// Ends with an error message and status 1 if the pairs differ.
#include "world/broad_phase.h"

#include <box2d/box2d.h>

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace {

using Random = std::mt19937;
using Pairs = std::vector<std::pair<std::uintptr_t, std::uintptr_t>>;

float between(Random& random, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(random);
}

int below(Random& random, int end) {
  return std::uniform_int_distribution<int>(0, end - 1)(random);
}

// A world whose fixtures have numbers in the order of their creation.
class Scene {
 public:
  explicit Scene(unsigned seed) : random_(seed), world_(b2Vec2(0.0F, 0.0F)) {}

  b2World& world() { return world_; }

  // Creates, moves, destroys and changes some bodies.
  void change() {
    for (int i = below(random_, 4); i >= 0; --i) add_body();
    for (int i = below(random_, 3); i > 0 && world_.GetBodyCount() > 0; --i) {
      b2Body* body = any_body();
      switch (below(random_, 5)) {
        case 0:
          world_.DestroyBody(body);
          break;
        case 1:
          body->SetType(static_cast<b2BodyType>(below(random_, 3)));
          break;
        case 2:
          body->SetEnabled(!body->IsEnabled());
          break;
        case 3:
          body->GetFixtureList()->Refilter();
          break;
        default:
          body->SetTransform({between(random_, -5.0F, 5.0F), between(random_, -5.0F, 5.0F)}, 1.0F);
      }
    }
  }

  Pairs pairs() const {
    Pairs found;
    for (const b2Contact* c = world_.GetContactList(); c != nullptr; c = c->GetNext()) {
      auto* contact = const_cast<b2Contact*>(c);
      found.emplace_back(contact->GetFixtureA()->GetUserData().pointer,
                         contact->GetFixtureB()->GetUserData().pointer);
    }
    return found;
  }

 private:
  b2Body* any_body() {
    b2Body* body = world_.GetBodyList();
    for (int i = below(random_, world_.GetBodyCount()); i > 0; --i) body = body->GetNext();
    return body;
  }

  void add_body() {
    b2BodyDef definition;
    const int kind = below(random_, 3);
    definition.type = kind == 0 ? b2_staticBody : kind == 1 ? b2_kinematicBody : b2_dynamicBody;
    definition.position = {between(random_, -9.0F, 9.0F), between(random_, -9.0F, 9.0F)};
    definition.linearVelocity = {between(random_, -2.0F, 2.0F), between(random_, -2.0F, 2.0F)};
    b2Body* body = world_.CreateBody(&definition);
    const int count = kind == 0 ? 1 + below(random_, 150) : 1 + below(random_, 3);
    for (int i = 0; i < count; ++i) {
      b2EdgeShape edge;
      const b2Vec2 a(between(random_, -9.0F, 9.0F), between(random_, -9.0F, 9.0F));
      edge.SetTwoSided(a, a + b2Vec2(between(random_, 0.1F, 2.0F), between(random_, 0.1F, 2.0F)));
      b2CircleShape circle;
      circle.m_radius = between(random_, 0.1F, 1.0F);
      b2FixtureDef fixture;
      fixture.shape = kind == 0 ? static_cast<b2Shape*>(&edge) : &circle;
      fixture.density = 1.0F;
      fixture.userData.pointer = ++number_;
      body->CreateFixture(&fixture);
    }
  }

  Random random_;
  b2World world_;
  std::uintptr_t number_ = 0;
};

}  // namespace

int main() {
  std::size_t contacts = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Scene ours(seed);
    Scene theirs(seed);
    for (int round = 0; round < 12; ++round) {
      ours.change();
      theirs.change();
      if (round % 2 == 0) {
        flatland::find_new_pairs(ours.world());
        const_cast<b2ContactManager&>(theirs.world().GetContactManager()).FindNewContacts();
      } else {
        flatland::begin_step(ours.world());
        ours.world().Step(0.01F, 4, 4);
        theirs.world().Step(0.01F, 4, 4);
      }
      if (flatland::pending_fixtures(ours.world()) != 0 || ours.pairs() != theirs.pairs()) {
        std::cerr << "seed " << seed << ", round " << round << ": the contacts differ" << std::endl;
        return 1;
      }
      contacts += ours.pairs().size();
    }
  }
  if (contacts < 10000) {
    std::cerr << "only " << contacts << " contacts" << std::endl;
    return 1;
  }
  return 0;
}
