#include "rays/ray_scene.h"

#include <box2d/b2_body.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_fixture.h>

#include <algorithm>
#include <utility>

#include "world/contacts.h"

namespace flatland {
namespace {

std::uint32_t slot_of(const b2Fixture* fixture) { return flatland::slot_of(id_of(fixture)); }

void collect_edges(const b2Body& body, const Materials& materials, std::vector<TreeEdge>& edges) {
  for (const b2Fixture* f = body.GetFixtureList(); f != nullptr; f = f->GetNext()) {
    if (f->GetType() != b2Shape::e_edge || f->IsSensor()) continue;
    const auto* edge = static_cast<const b2EdgeShape*>(f->GetShape());
    TreeEdge added{edge->m_vertex1.x, edge->m_vertex1.y, edge->m_vertex2.x, edge->m_vertex2.y,
                   f->GetFilterData().categoryBits};
    added.fixture = slot_of(f);
    added.material = materials.number_of(added.fixture);
    edges.push_back(added);
  }
}

std::shared_ptr<const EdgeTree> make_tree(const std::vector<const b2Body*>& bodies,
                                          const Materials& materials) {
  std::vector<TreeEdge> edges;
  for (const b2Body* body : bodies) collect_edges(*body, materials, edges);
  if (bodies.size() > 1) merge_coincident(edges);
  return std::make_shared<const EdgeTree>(std::move(edges));
}

bool is_same(const b2Transform& a, const b2Transform& b) {
  return a.p == b.p && a.q.s == b.q.s && a.q.c == b.q.c;
}

}  // namespace

void RayScene::add(b2Fixture* fixture) {
  if (fixture->GetType() != b2Shape::e_edge) {
    solids_.push_back(fixture);
    return;
  }
  if (EdgeBody* known = find(fixture->GetBody())) {
    known->is_changed = true;
  } else {
    edge_bodies_.push_back({fixture->GetBody(), true, false});
  }
  is_grouped_ = false;
}

void RayScene::remove_body(const b2Body* body) {
  for (const b2Fixture* f = body->GetFixtureList(); f != nullptr && !materials_.is_empty();
       f = f->GetNext()) {
    materials_.erase(slot_of(f));
  }
  const auto has_solid = [body](const b2Fixture* fixture) { return fixture->GetBody() == body; };
  solids_.erase(std::remove_if(solids_.begin(), solids_.end(), has_solid), solids_.end());
  const auto is_same_body = [body](const EdgeBody& candidate) { return candidate.body == body; };
  const auto rest = std::remove_if(edge_bodies_.begin(), edge_bodies_.end(), is_same_body);
  if (rest != edge_bodies_.end()) is_grouped_ = false;
  edge_bodies_.erase(rest, edge_bodies_.end());
}

void RayScene::changed(const b2Fixture* fixture) {
  if (fixture->GetType() != b2Shape::e_edge) return;
  if (EdgeBody* known = find(fixture->GetBody())) known->is_changed = true;
  is_grouped_ = false;
}

void RayScene::set_material(const b2Fixture* fixture, const Material& material) {
  materials_.set(slot_of(fixture), material);
  changed(fixture);
}

void RayScene::clear() {
  materials_.clear();
  solids_.clear();
  edge_bodies_.clear();
  edge_groups_.clear();
}

void RayScene::become_copy_of(RayScene& source,
                              const std::function<const b2Body*(const b2Body*)>& copy_of,
                              const std::function<b2Fixture*(const b2Fixture*)>& copy_of_fixture) {
  std::vector<b2Fixture*> solids;
  for (const b2Fixture* fixture : source.solids_) solids.push_back(copy_of_fixture(fixture));
  std::vector<EdgeGroup> groups =
      source.edge_groups();  // creates missing trees, so that they are shared
  for (EdgeGroup& group : groups) {
    for (const b2Body*& body : group.bodies) body = copy_of(body);
  }
  std::vector<EdgeBody> bodies = source.edge_bodies_;
  for (EdgeBody& edge_body : bodies) edge_body.body = copy_of(edge_body.body);
  Materials materials = source.materials_;
  materials_ = std::move(materials);
  solids_ = std::move(solids);
  edge_groups_ = std::move(groups);
  edge_bodies_ = std::move(bodies);
  is_grouped_ = true;
}

const std::vector<EdgeGroup>& RayScene::edge_groups() {
  const std::lock_guard<std::mutex> lock(groups_mutex_);
  if (is_grouped_) find_moved_bodies();
  if (!is_grouped_) make_groups();
  return edge_groups_;
}

void RayScene::find_moved_bodies() {
  for (const EdgeGroup& group : edge_groups_) {
    if (group.bodies.size() == 1) continue;
    for (const b2Body* body : group.bodies) {
      if (is_same(body->GetTransform(), group.pose)) continue;
      find(body)->is_separate = true;
      is_grouped_ = false;
    }
  }
}

void RayScene::make_groups() {
  std::vector<EdgeGroup> groups;
  for (const EdgeBody& edge_body : edge_bodies_) {
    const b2Transform& pose = edge_body.body->GetTransform();
    const bool may_join = edge_body.body->GetType() == b2_staticBody && !edge_body.is_separate;
    const auto is_joinable = [&](const EdgeGroup& group) {
      const b2Body* first = group.bodies.front();
      return is_same(group.pose, pose) && first->GetType() == b2_staticBody &&
             !find(first)->is_separate;
    };
    const auto group =
        may_join ? std::find_if(groups.begin(), groups.end(), is_joinable) : groups.end();
    if (group == groups.end()) {
      groups.push_back({{edge_body.body}, pose, nullptr});
    } else {
      group->bodies.push_back(edge_body.body);
    }
  }
  for (EdgeGroup& group : groups) {
    const auto has_same_bodies = [&](const EdgeGroup& old) { return old.bodies == group.bodies; };
    const auto known = std::find_if(edge_groups_.begin(), edge_groups_.end(), has_same_bodies);
    const bool is_unchanged = known != edge_groups_.end() &&
                              std::none_of(group.bodies.begin(), group.bodies.end(),
                                           [this](const b2Body* body) { return is_changed(body); });
    group.tree = is_unchanged ? known->tree : make_tree(group.bodies, materials_);
  }
  edge_groups_ = std::move(groups);
  for (EdgeBody& edge_body : edge_bodies_) edge_body.is_changed = false;
  is_grouped_ = true;
}

bool RayScene::is_changed(const b2Body* body) { return find(body)->is_changed; }

RayScene::EdgeBody* RayScene::find(const b2Body* body) {
  // Backwards, because edges are usually added to the most recent body.
  const auto known = std::find_if(edge_bodies_.rbegin(), edge_bodies_.rend(),
                                  [body](const EdgeBody& e) { return e.body == body; });
  return known == edge_bodies_.rend() ? nullptr : &*known;
}

}  // namespace flatland
