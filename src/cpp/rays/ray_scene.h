// The fixtures of a world, organized for ray casting.
#pragma once

#include <box2d/b2_math.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "rays/beam_fan.h"
#include "rays/edge_tree.h"
#include "rays/materials.h"
#include "rays/scan_memory.h"
#include "world/slot_map.h"

class b2Body;
class b2Fixture;

namespace flatland {

// The edges of one body, or of several static bodies with the same pose, such as layers with the
// same origin, in one tree.
struct EdgeGroup {
  std::vector<const b2Body*> bodies;
  b2Transform pose;  // of all bodies at the creation of the group
  std::shared_ptr<const EdgeTree> tree;
};

// The fixtures of a world for ray casting. Edges are stored in trees that are created on demand,
// circles and polygons in a list. Moving a body causes no rebuild unless it shares its
// tree with other bodies.
class RayScene {
 public:
  using Fixtures = SlotMap<b2Fixture*, IdKind::kFixture>;

  // The fixtures of the world must outlive the scene.
  explicit RayScene(const Fixtures& fixtures) : fixtures_(fixtures) {}

  void add(b2Fixture* fixture);
  // Removes all fixtures of a body.
  void remove_body(const b2Body* body);
  // To be called after a change of the category bits or the sensor flag of a fixture.
  void changed(const b2Fixture* fixture);
  // Gives a fixture a material.
  void set_material(const b2Fixture* fixture, const Material& material);
  void clear();
  // Makes this scene that of a copy of a world, which shares the trees of edges.
  void become_copy_of(RayScene& source, const std::function<const b2Body*(const b2Body*)>& copy_of,
                      const std::function<b2Fixture*(const b2Fixture*)>& copy_of_fixture);

  // The members below are thread-safe with respect to each other, but not to those above.
  const std::vector<b2Fixture*>& solids() const { return solids_; }
  const std::vector<EdgeGroup>& edge_groups();
  FanCache& fans() { return fans_; }
  ScanMemoryPool& memories() { return memories_; }
  const Materials& materials() const { return materials_; }
  // The fixture whose id has a slot; null if it was destroyed.
  const b2Fixture* fixture_at(std::uint32_t slot) const {
    b2Fixture* const* fixture = fixtures_.at_slot(slot);
    return fixture == nullptr ? nullptr : *fixture;
  }

 private:
  struct EdgeBody {
    const b2Body* body;
    bool is_changed;   // since its group was created
    bool is_separate;  // was moved out of a group and joins no group again
  };

  EdgeBody* find(const b2Body* body);
  bool is_changed(const b2Body* body);
  // Marks the bodies that were moved since their group was created.
  void find_moved_bodies();
  void make_groups();

  const Fixtures& fixtures_;
  Materials materials_;
  std::vector<b2Fixture*> solids_;
  std::vector<EdgeBody> edge_bodies_;
  std::vector<EdgeGroup> edge_groups_;
  bool is_grouped_ = true;
  std::mutex groups_mutex_;
  FanCache fans_;
  ScanMemoryPool memories_;
};

}  // namespace flatland
