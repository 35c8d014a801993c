// What rays can hit.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "beam_fan.h"
#include "edge_tree.h"

class b2Body;
class b2Fixture;

namespace flatland {

// The edges of one body, in a tree that is made when it is first needed.
struct EdgeBody {
  b2Body* body;
  std::shared_ptr<const EdgeTree> tree;
};

// The fixtures of a world, sorted for ray casting: the edges of each body in a tree of their own,
// circles and polygons one by one. Moving a body changes nothing here.
class RayScene {
 public:
  void add(b2Fixture* fixture);
  // Takes all fixtures of a body out.
  void remove_body(const b2Body* body);
  // The category or sensor flag of a fixture is another.
  void changed(const b2Fixture* fixture);
  void clear();

  // For casting, by several threads at once; nothing above may be called meanwhile.
  const std::vector<b2Fixture*>& solids() const { return solids_; }
  const std::vector<EdgeBody>& edge_bodies();  // with their trees
  FanCache& fans() { return fans_; }

 private:
  EdgeBody* find(const b2Body* body);

  std::vector<b2Fixture*> solids_;
  std::vector<EdgeBody> edge_bodies_;
  bool has_all_trees_ = true;
  std::mutex trees_mutex_;
  FanCache fans_;
};

}  // namespace flatland
