#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <unordered_set>
#include <utility>
#include <vector>

#include "agents/agent_batch.h"
#include "bindings/bindings.h"
#include "bindings/runs.h"

namespace py = pybind11;

namespace flatland {
namespace {

template <typename Scalar>
using Rows = py::array_t<Scalar, py::array::c_style>;

// A body, its controller, the collector of its contacts, and its range finder.
using PyAgent =
    std::tuple<BodyHandle, ControllerHandle, TouchesHandle, std::shared_ptr<RangeFinder>>;

Agent to_agent(const PyAgent& given) {
  const auto& [body, controller, touches, finder] = given;
  if (finder == nullptr) throw py::type_error("an agent requires a range finder, got None");
  World& world = body.core();
  if (finder->has_intensities(world.rays())) {
    throw py::value_error("the range finder of an agent must not measure intensities");
  }
  return {&world, body.id, id_in(world, controller), id_in(world, touches), finder};
}

// Keeps the worlds of the agents alive.
class PyAgentBatch {
 public:
  explicit PyAgentBatch(const std::vector<PyAgent>& given) : batch_(to_agents(given)) {
    for (const PyAgent& agent : given) worlds_.push_back(std::get<0>(agent).world);
  }

  py::list perform(const PyRun& given_run, const Rows<bool>& steps, const Rows<bool>& observes,
                   const Rows<double>& velocities, const Rows<std::int64_t>& times,
                   const Rows<std::uint64_t>& noises, Rows<double>& poses, Rows<double>& pose_rates,
                   Rows<double>& sensor_poses, Rows<float>& ranges, Rows<bool>& touched,
                   std::size_t num_threads) {
    const std::size_t readings = batch_.agents().front().finder->readings();
    check(steps, 1, "steps");
    check(observes, 1, "observes");
    check(velocities, 2, "velocities");
    check(times, 1, "times");
    check(noises, 2, "noises");
    check(poses, 3, "poses");
    check(pose_rates, 3, "pose_rates");
    check(sensor_poses, 3, "sensor_poses");
    check(ranges, readings, "ranges");
    check(touched, 1, "touched");
    const AgentCommands commands{steps.data(), observes.data(), velocities.data(), times.data(),
                                 noises.data()};
    const AgentRows rows{poses.mutable_data(), pose_rates.mutable_data(),
                         sensor_poses.mutable_data(), ranges.mutable_data(),
                         touched.mutable_data()};
    const Run run = to_run(given_run);
    run.check();
    // Safe without the GIL: the worlds are in use, and the caller keeps the arrays alive.
    Uses uses(batch_.agents());
    const bool is_long = batch_.expected_time(commands, run) > kShortStep;
    const auto unfinished = without_gil_if(is_long, uses, [&] {
      return batch_.perform(commands, run, rows, is_long ? num_threads : 1);
    });
    py::list list;
    for (const UnfinishedRun& each : unfinished) {
      py::object result = each.error ? error_of(each.error) : py::cast(result_tuple(each.result));
      list.append(py::make_tuple(each.agent, std::move(result)));
    }
    return list;
  }

 private:
  // Exclusive uses of all worlds that end together.
  class Uses {
   public:
    explicit Uses(const std::vector<Agent>& agents) {
      uses_.reserve(agents.size());
      for (const Agent& agent : agents) {
        uses_.push_back(std::make_unique<World::ExclusiveUse>(*agent.world, World::kStepping));
      }
    }
    void end() { uses_.clear(); }

   private:
    std::vector<std::unique_ptr<World::ExclusiveUse>> uses_;
  };

  static std::vector<Agent> to_agents(const std::vector<PyAgent>& given) {
    if (given.empty()) throw py::value_error("a batch requires an agent");
    std::vector<Agent> agents;
    std::unordered_set<const World*> worlds;
    for (const PyAgent& each : given) {
      agents.push_back(to_agent(each));
      if (!worlds.insert(agents.back().world).second) {
        throw py::value_error("the agents of a batch must have different worlds");
      }
      if (agents.back().finder->readings() != agents.front().finder->readings()) {
        throw py::value_error("the agents of a batch must have equal numbers of readings");
      }
    }
    return agents;
  }

  template <typename Scalar>
  void check(const Rows<Scalar>& array, std::size_t columns, const char* name) const {
    if (static_cast<std::size_t>(array.size()) != columns * batch_.agents().size() ||
        static_cast<std::size_t>(array.shape(0)) != batch_.agents().size()) {
      throw py::value_error(std::string(name) + " must have a row of " + std::to_string(columns) +
                            " for each agent");
    }
  }

  AgentBatch batch_;
  std::vector<PyWorld> worlds_;
};

}  // namespace

void bind_agents(py::module_& module) {
  py::class_<PyAgentBatch>(module, "AgentBatch", R"(
Driven bodies with range finders, each in a world of its own, which advance in parallel.
)")
      .def(py::init<const std::vector<PyAgent>&>(), py::arg("agents"), R"(
Creates a batch of n agents.

Args:
    agents: For each agent a body, the controller of its velocity, the collector of its contacts,
        and a range finder.

Raises:
    ValueError: Two agents have the same world, their numbers of readings differ, or a range finder
        measures intensities.
)")
      .def("perform", &PyAgentBatch::perform, py::arg("run"), py::arg("steps").noconvert(),
           py::arg("observes").noconvert(), py::arg("velocities").noconvert(),
           py::arg("times").noconvert(), py::arg("noises").noconvert(),
           py::arg("poses").noconvert(), py::arg("pose_rates").noconvert(),
           py::arg("sensor_poses").noconvert(), py::arg("ranges").noconvert(),
           py::arg("touched").noconvert(), py::arg("num_threads"), R"(
Sets the commands of agents, performs steps of their worlds, and observes them.

All arrays are C-contiguous, with a row for each agent. The results do not depend on the number of
threads.

Args:
    run: The steps, as `Run`; each world has a time of its own.
    steps: Whether the world of the agent steps, shape (n,).
    observes: Whether the agent is observed, after its steps, shape (n,).
    velocities: Commanded forward speed and yaw rate [m/s, rad/s], shape (n, 2).
    times: Simulated times of the worlds [ns], shape (n,).
    noises: Stream and number of the update of each scan, shape (n, 2).
    poses: Receives (x, y, theta) of the bodies in the world frame, shape (n, 3).
    pose_rates: Receives the velocities of their origins (vx, vy, omega), shape (n, 3).
    sensor_poses: Receives the poses of the range finders in the world frame, shape (n, 3).
    ranges: Receives the readings [m], shape (n, readings), float32.
    touched: Receives whether an agent touched anything in its steps, shape (n,).
    num_threads: Maximum number of threads; 0 for one per core.

Returns:
    Agents whose steps are not complete, with what `JobQueue.run` returns or raises. They are not
    observed.

Raises:
    ValueError: An array has another shape, or a number is out of range.
    StaleHandleError: A world is closed.
    WorldLockedError: A world is in use.
)");
}

}  // namespace flatland
