#include "ray_scene.h"

#include <box2d/b2_body.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_fixture.h>

#include <algorithm>
#include <utility>

namespace flatland {
namespace {

std::shared_ptr<const EdgeTree> make_tree(const b2Body& body) {
  std::vector<TreeEdge> edges;
  for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (f->GetType() != b2Shape::e_edge || f->IsSensor()) continue;
    const auto* edge = static_cast<const b2EdgeShape*>(f->GetShape());
    edges.push_back({edge->m_vertex1.x, edge->m_vertex1.y, edge->m_vertex2.x, edge->m_vertex2.y,
                     f->GetFilterData().categoryBits});
  }
  return std::make_shared<const EdgeTree>(std::move(edges));
}

}  // namespace

void RayScene::add(b2Fixture* fixture) {
  if (fixture->GetType() != b2Shape::e_edge) {
    solids_.push_back(fixture);
    return;
  }
  EdgeBody* known = find(fixture->GetBody());
  if (known == nullptr) {
    edge_bodies_.push_back({fixture->GetBody(), nullptr});
  } else {
    known->tree.reset();
  }
  has_all_trees_ = false;
}

void RayScene::remove_body(const b2Body* body) {
  const auto has_solid = [body](const b2Fixture* fixture) { return fixture->GetBody() == body; };
  solids_.erase(std::remove_if(solids_.begin(), solids_.end(), has_solid), solids_.end());
  const auto is_it = [body](const EdgeBody& candidate) { return candidate.body == body; };
  edge_bodies_.erase(std::remove_if(edge_bodies_.begin(), edge_bodies_.end(), is_it),
                     edge_bodies_.end());
}

void RayScene::changed(const b2Fixture* fixture) {
  if (fixture->GetType() != b2Shape::e_edge) return;
  if (EdgeBody* known = find(fixture->GetBody())) known->tree.reset();
  has_all_trees_ = false;
}

void RayScene::clear() {
  solids_.clear();
  edge_bodies_.clear();
}

const std::vector<EdgeBody>& RayScene::edge_bodies() {
  const std::lock_guard<std::mutex> lock(trees_mutex_);
  if (!has_all_trees_) {
    for (EdgeBody& candidate : edge_bodies_) {
      if (candidate.tree == nullptr) candidate.tree = make_tree(*candidate.body);
    }
    has_all_trees_ = true;
  }
  return edge_bodies_;
}

EdgeBody* RayScene::find(const b2Body* body) {
  // The latest first: many edges are added to one body after another.
  const auto known = std::find_if(edge_bodies_.rbegin(), edge_bodies_.rend(),
                                  [body](const EdgeBody& e) { return e.body == body; });
  return known == edge_bodies_.rend() ? nullptr : &*known;
}

}  // namespace flatland
