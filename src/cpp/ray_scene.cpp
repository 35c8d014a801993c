#include "ray_scene.h"

#include <box2d/b2_fixture.h>

#include <algorithm>

namespace flatland {

void RayScene::add(b2Fixture* fixture) {
  if (fixture->GetType() != b2Shape::e_edge) solids_.push_back(fixture);
}

void RayScene::remove_body(const b2Body* body) {
  const auto is_of_body = [body](const b2Fixture* fixture) { return fixture->GetBody() == body; };
  solids_.erase(std::remove_if(solids_.begin(), solids_.end(), is_of_body), solids_.end());
}

void RayScene::changed(const b2Fixture* /*fixture*/) {}

void RayScene::clear() { solids_.clear(); }

}  // namespace flatland
