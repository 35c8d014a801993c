// The parts of the extension module. It exposes the class `_core.World`, whose methods take ids;
// flatland.physics wraps the ids in handles. Engine code does not include this file.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <utility>

#include "world/world.h"

namespace flatland {

using WorldClass = pybind11::class_<World, std::shared_ptr<World>>;

void bind_errors();
WorldClass bind_world(pybind11::module_& module);
void bind_bodies(WorldClass& world);
void bind_crowd(pybind11::module_& module, WorldClass& world);
void bind_fixtures(WorldClass& world);
void bind_joints(WorldClass& world);
void bind_motions(WorldClass& world);
void bind_contacts(pybind11::module_& module, WorldClass& world);
void bind_raycast(WorldClass& world);
void bind_range_finder(pybind11::module_& module);
void bind_controllers(pybind11::module_& module, WorldClass& world);
void bind_steps(WorldClass& world);
void bind_paced_run(WorldClass& world);
void bind_run_worlds(pybind11::module_& module);
void bind_touches(WorldClass& world);
void bind_overlap(WorldClass& world);
void bind_map_edges(pybind11::module_& module);

// Calls work() and ends the use of the world, even if work() throws.
template <typename Use, typename Work>
auto while_in_use(Use& use, Work&& work) {
  struct EndOfUse {
    Use& use;
    ~EndOfUse() { use.end(); }
  } end{use};
  return work();
}

// Calls work() without the GIL while the world is in use. The use, which starts with the GIL held,
// ends before the GIL is acquired again: another thread that holds the GIL may be waiting for the
// end of the use.
template <typename Use, typename Work>
auto without_gil(Use& use, Work&& work) {
  const pybind11::gil_scoped_release unlocked;
  return while_in_use(use, std::forward<Work>(work));
}

// The same, with the GIL held if the work is short. A thread that waits for the GIL requests it
// when it has waited for the switch interval of Python, and starts to wait again whenever the GIL
// has been released for a moment: a loop of short calls that release it would starve all other
// threads.
template <typename Use, typename Work>
auto without_gil_if(bool is_long, Use& use, Work&& work) {
  return is_long ? without_gil(use, work) : while_in_use(use, work);
}

// A step that is expected to be shorter is not worth a release of the GIL [s].
inline constexpr double kShortStep = 1e-4;

// None for an empty report, else the ids of limited and of invalid bodies.
pybind11::object to_python(const StepReport& report);

// Converts a Python int to 16 bits; throws a ValueError that names `what` if it is out of range.
std::uint16_t checked_bits(std::int64_t bits, const char* what);

}  // namespace flatland
