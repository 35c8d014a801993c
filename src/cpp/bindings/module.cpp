#include <box2d/box2d.h>

#include <string>

#include "bindings/bindings.h"
#include "bindings/masks.h"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The physics engine; used only by flatland.physics, which documents it.";
  module.attr("BOX2D_VERSION") = std::to_string(b2_version.major) + "." +
                                 std::to_string(b2_version.minor) + "." +
                                 std::to_string(b2_version.revision);
  flatland::bind_errors();
  flatland::Classes classes(module);
  flatland::bind_handles(classes.handle);
  flatland::bind_range_finder(module);
  flatland::bind_world(classes.world);
  flatland::bind_bodies(classes);
  flatland::bind_fixtures(classes);
  flatland::bind_joints(classes);
  flatland::bind_controllers(module, classes);
  flatland::bind_motions(classes);
  flatland::bind_crowd(module, classes);
  flatland::bind_touches(classes);
  flatland::bind_contacts(module, classes);
  flatland::bind_copying(module);
  flatland::bind_raycast(classes.world);
  flatland::bind_overlap(classes.world);
  flatland::bind_jobs(module, classes);
  flatland::bind_agents(module);
  flatland::bind_map_edges(module);
  flatland::bind_masks(module);
}
