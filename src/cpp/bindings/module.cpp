#include "bindings/bindings.h"

PYBIND11_MODULE(_core, module) {
  module.doc() = "Box2D objects by id; used only by flatland.physics.";
  flatland::bind_errors();
  flatland::WorldClass world = flatland::bind_world(module);
  flatland::bind_bodies(world);
  flatland::bind_fixtures(world);
  flatland::bind_joints(world);
  flatland::bind_contacts(module, world);
  flatland::bind_raycast(world);
  flatland::bind_overlap(world);
  flatland::bind_map_edges(module);
}
