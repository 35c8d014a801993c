// The bodies of a world by type, for the loops of a step.
#pragma once

#include <box2d/b2_body.h>
#include <box2d/b2_world.h>

#include <vector>

namespace flatland {

// Each list is in the order of Box2D. Valid until a body is created or destroyed.
struct BodiesByType {
  std::vector<b2Body*> fixed;  // static
  std::vector<b2Body*> kinematic;
  std::vector<b2Body*> dynamic;

  void read(b2World& world) {
    fixed.clear();
    kinematic.clear();
    dynamic.clear();
    for (b2Body* body = world.GetBodyList(); body != nullptr; body = body->GetNext()) {
      of(body->GetType()).push_back(body);
    }
  }

 private:
  std::vector<b2Body*>& of(b2BodyType type) {
    return type == b2_staticBody ? fixed : type == b2_kinematicBody ? kinematic : dynamic;
  }
};

}  // namespace flatland
