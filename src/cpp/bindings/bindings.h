// The parts of the extension module. Engine code does not include this file.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings/handles.h"
#include "world/world.h"

namespace flatland {

using WorldClass = pybind11::class_<World, std::shared_ptr<World>>;

void bind_errors();
void bind_world(WorldClass& world);
void bind_handles(pybind11::class_<Handle>& handle);
void bind_bodies(Classes& classes);
void bind_fixtures(Classes& classes);
void bind_joints(Classes& classes);
void bind_controllers(pybind11::module_& module, Classes& classes);
void bind_motions(Classes& classes);
void bind_crowd(pybind11::module_& module, Classes& classes);
void bind_touches(Classes& classes);
void bind_contacts(pybind11::module_& module, Classes& classes);
void bind_copying(pybind11::module_& module);
void bind_raycast(WorldClass& world);
void bind_overlap(WorldClass& world);
void bind_range_finder(pybind11::module_& module);
void bind_jobs(pybind11::module_& module, Classes& classes);
void bind_agents(pybind11::module_& module);
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

// The ids of limited and of invalid bodies.
using PyReport = std::pair<std::vector<Id>, std::vector<Id>>;
// None for an empty report.
std::optional<PyReport> to_python(const StepReport& report);

// Converts a Python int to 16 bits; throws a ValueError that names `what` if it is out of range.
std::uint16_t checked_bits(std::int64_t bits, const char* what);

// Returns the choice with a name; throws a ValueError that names `what` if there is none.
template <typename Value>
Value chosen(const std::string& name, const std::string& what,
             std::initializer_list<std::pair<const char*, Value>> choices) {
  std::string names;
  for (const auto& [each, value] : choices) {
    if (name == each) return value;
    names += (names.empty() ? "" : ", ") + std::string(each);
  }
  throw pybind11::value_error(what + " must be one of: " + names + ", got \"" + name + "\"");
}

}  // namespace flatland
