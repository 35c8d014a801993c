// The parts of the extension. Python knows one class of the engine, `_core.World`, and ids;
// flatland.physics makes handles of them. Engine code never includes this file.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>

#include "world/world.h"

namespace flatland {

using WorldClass = pybind11::class_<World, std::shared_ptr<World>>;

void bind_errors();
WorldClass bind_world(pybind11::module_& module);
void bind_bodies(WorldClass& world);
void bind_fixtures(WorldClass& world);
void bind_joints(WorldClass& world);
void bind_contacts(pybind11::module_& module, WorldClass& world);
void bind_raycast(WorldClass& world);
void bind_overlap(WorldClass& world);
void bind_map_edges(pybind11::module_& module);

// Calls work() without the GIL, for as long as the world is held. The use, begun with the GIL, ends
// before the GIL is asked for again, however work() ends: somebody may wait for the use with it.
template <typename Use, typename Work>
auto without_gil(Use& use, Work&& work) {
  const pybind11::gil_scoped_release unlocked;
  struct EndOfUse {
    Use& use;
    ~EndOfUse() { use.end(); }
  } end{use};
  return work();
}

// None for an empty report, else the ids of limited and of invalid bodies.
pybind11::object to_python(const StepReport& report);

// Bits as Python has them: any int, refused with a clear text beyond 16 bits.
std::uint16_t checked_bits(std::int64_t bits, const char* what);

}  // namespace flatland
