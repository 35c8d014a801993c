// What rays can hit.
#pragma once

#include <box2d/b2_math.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "rays/beam_fan.h"
#include "rays/edge_tree.h"

class b2Body;
class b2Fixture;

namespace flatland {

// The edges of bodies that stand at the same place, in one tree: the layers of a world with one
// origin, or a single body.
struct EdgeGroup {
  std::vector<const b2Body*> bodies;
  b2Transform pose;  // of all of them, when the group was made
  std::shared_ptr<const EdgeTree> tree;
};

// The fixtures of a world, sorted for ray casting: edges in trees that are made when they are first
// needed, circles and polygons one by one. Moving a body alone costs nothing here.
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
  const std::vector<EdgeGroup>& edge_groups();
  FanCache& fans() { return fans_; }

 private:
  struct EdgeBody {
    const b2Body* body;
    bool is_changed;  // since it was put into a group
    bool is_alone;    // left a group by moving away, and joins none again
  };

  EdgeBody* find(const b2Body* body);
  bool is_changed(const b2Body* body);
  // Marks the bodies that are not any more where their group is.
  void find_moved_bodies();
  void make_groups();

  std::vector<b2Fixture*> solids_;
  std::vector<EdgeBody> edge_bodies_;
  std::vector<EdgeGroup> edge_groups_;
  bool is_grouped_ = true;
  std::mutex groups_mutex_;
  FanCache fans_;
};

}  // namespace flatland
