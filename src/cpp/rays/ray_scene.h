// The fixtures of a world, organized for ray casting.
//
// Begin to read this folder here. A scan computes the range of each beam of a range finder. The
// order in which the parts of a scan build on each other is the order of reading:
//
// 1. What the rays are and what they hit
//    ray_scene      the fixtures of a world: trees of edges, and a list of circles and polygons
//    edge_tree      a bounding-volume tree of edges in the frame of a body; lasts for many scans
//    solid_tree     a tree of circles and polygons in the world frame; lasts for one batch of scans
//    beam_fan       the beams of a range finder, sorted by direction; a cache of fans
//    materials      what surfaces do to beams: reflectance, transmission, mirrors
//    aligned_floats arrays of floats for vectors
// 2. One scan
//    depth_scan     draws edges and solids into a depth buffer over the rays of a fan
//    scene_view     draws a whole scene into a depth scan, and finds reflecting fixtures
//    raycast        a scan of fractions, and a single ray; a slow reference for tests
// 3. The kernels of a depth scan, compiled once for each instruction set (instruction_set)
//    simd, simd_x86 vectors of 8 or 16 floats
//    every_instruction_set  compiles a kernel for each of them
//    depth_kernel   the entry points, called by depth_scan.cpp
//    ray_kernel     a vector of rays and their hits
//    box_kernel     which rays a bounding box covers; the traversal of a tree, front to back
//    edge_kernel    the fractions at which rays cross edges
//    solid_kernel   the fractions at which rays hit circles and polygons
// 4. Rays in a world with materials
//    trace          the paths of rays through glass, with at most one reflection
//    mirrors        groups reflected rays by mirror; the image of a sensor in a mirror
//    reflection     scans from the images of the sensor
// 5. Readings
//    range_finder   from fractions to ranges, intensities and labels
//    range_noise    noise, limits and intensities; range_kernel and random_kernel are its loops
//    scan_batch     the scans of many range finders on several threads
//    scan_memory    memory that scans use again
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

// A tree of the edges of one body, or of several static bodies with the same pose, such as layers
// with the same origin.
struct EdgeGroup {
  std::vector<const b2Body*> bodies;
  b2Transform pose;  // pose of all bodies when the group was created
  std::shared_ptr<const EdgeTree> tree;
};

// The fixtures of a world for ray casting. Edges are stored in trees that are created on demand,
// circles and polygons in a list. A tree remains valid if a body moves, unless several bodies share
// the tree.
class RayScene {
 public:
  using Fixtures = SlotMap<b2Fixture*, IdKind::kFixture>;

  // The fixtures of the world must outlive the scene.
  explicit RayScene(const Fixtures& fixtures) : fixtures_(fixtures) {}

  void add(b2Fixture* fixture);
  // Removes all fixtures of a body.
  void remove_body(const b2Body* body);
  // Must be called after a change of the category bits or the sensor flag of a fixture.
  void changed(const b2Fixture* fixture);
  // Sets the material of a fixture.
  void set_material(const b2Fixture* fixture, const Material& material);
  void clear();
  // Makes this scene the scene of a copy of a world. The copy shares the trees of edges.
  void become_copy_of(RayScene& source, const std::function<const b2Body*(const b2Body*)>& copy_of,
                      const std::function<b2Fixture*(const b2Fixture*)>& copy_of_fixture);

  // Several threads may call the functions below at a time, but not together with the functions
  // above.
  const std::vector<b2Fixture*>& solids() const { return solids_; }
  const std::vector<EdgeGroup>& edge_groups();
  FanCache& fans() { return fans_; }
  ScanMemoryPool& memories() { return memories_; }
  const Materials& materials() const { return materials_; }
  // Returns the fixture with a slot; null if the fixture was destroyed.
  const b2Fixture* fixture_at(std::uint32_t slot) const {
    b2Fixture* const* fixture = fixtures_.at_slot(slot);
    return fixture == nullptr ? nullptr : *fixture;
  }

 private:
  struct EdgeBody {
    const b2Body* body;
    bool is_changed;   // whether the edges have changed since the group was created
    bool is_separate;  // whether the body was moved out of a group; it then joins no group again
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
