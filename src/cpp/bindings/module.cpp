#include <box2d/box2d.h>

#include <string>

#include "bindings/bindings.h"

PYBIND11_MODULE(_core, module) {
  module.doc() = "Box2D objects by id; used only by flatland.physics.";
  module.attr("BOX2D_VERSION") = std::to_string(b2_version.major) + "." +
                                 std::to_string(b2_version.minor) + "." +
                                 std::to_string(b2_version.revision);
  flatland::bind_errors();
  flatland::WorldClass world = flatland::bind_world(module);
  flatland::bind_bodies(world);
  flatland::bind_crowd(module, world);
  flatland::bind_fixtures(world);
  flatland::bind_joints(world);
  flatland::bind_contacts(module, world);
  flatland::bind_raycast(world);
  flatland::bind_range_finder(module);
  flatland::bind_controllers(module, world);
  flatland::bind_steps(world);
  flatland::bind_paced_run(world);
  flatland::bind_run_worlds(module);
  flatland::bind_touches(world);
  flatland::bind_overlap(world);
  flatland::bind_map_edges(module);
}
