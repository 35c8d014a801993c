#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "agents/agent_batch.h"
#include "agents/observations.h"
#include "bindings/bindings.h"
#include "bindings/runs.h"

namespace py = pybind11;

namespace flatland {
namespace {

template <typename Scalar>
using Rows = py::array_t<Scalar, py::array::c_style>;

// Throws a ValueError unless an array has a row for each agent.
template <typename Scalar>
void check_rows(const Rows<Scalar>& array, std::size_t agents, std::size_t columns,
                const char* name) {
  if (array.ndim() == 0 || static_cast<std::size_t>(array.shape(0)) != agents ||
      static_cast<std::size_t>(array.size()) != columns * agents) {
    throw py::value_error(std::string(name) + " must have a row of " + std::to_string(columns) +
                          " for each agent");
  }
}

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

// Steps of agents that are expected to be shorter are not worth a second thread [s]. With the
// scans, they take about twice as long.
constexpr double kShortBatch = 5e-5;

// Keeps the worlds of the agents alive.
class PyAgentBatch {
 public:
  explicit PyAgentBatch(const std::vector<PyAgent>& given) : batch_(to_agents(given)) {
    for (const PyAgent& agent : given) worlds_.push_back(std::get<0>(agent).world);
  }

  void replace(std::size_t row, const PyAgent& given) {
    check_row(row);
    Agent agent = to_agent(given);
    for (std::size_t i = 0; i < batch_.agents().size(); ++i) {
      if (i != row) check_beside(agent, batch_.agents()[i]);
    }
    batch_.replace(row, std::move(agent));
    worlds_[row] = std::get<0>(given).world;
  }
  void permit(std::size_t row) {
    check_row(row);
    batch_.permit(row);
  }
  void withdraw(std::size_t row) {
    check_row(row);
    batch_.withdraw(row);
  }
  std::vector<std::size_t> not_permitted(const Rows<bool>& acts) const {
    check_rows(acts, batch_.agents().size(), 1, "acts");
    return batch_.not_permitted(acts.data());
  }

  void start(const PyRun& given_run, const Rows<bool>& acts, const Rows<bool>& observes,
             const Rows<double>& velocities, const Rows<std::uint64_t>& noises, Rows<double>& poses,
             Rows<double>& pose_rates, Rows<double>& sensor_poses, Rows<float>& ranges,
             Rows<bool>& touched, std::size_t num_threads) {
    if (uses_) throw py::value_error("the batch has begun already");
    const std::size_t agents = batch_.agents().size();
    const std::size_t readings = batch_.agents().front().finder->readings();
    check_rows(acts, agents, 1, "acts");
    check_rows(observes, agents, 1, "observes");
    check_rows(velocities, agents, 3, "velocities");
    check_rows(noises, agents, 2, "noises");
    check_rows(poses, agents, 3, "poses");
    check_rows(pose_rates, agents, 3, "pose_rates");
    check_rows(sensor_poses, agents, 3, "sensor_poses");
    check_rows(ranges, agents, readings, "ranges");
    check_rows(touched, agents, 1, "touched");
    const AgentCommands commands{acts.data(), observes.data(), velocities.data(), noises.data()};
    const AgentObservations rows{poses.mutable_data(), pose_rates.mutable_data(),
                                 sensor_poses.mutable_data(), ranges.mutable_data(),
                                 touched.mutable_data()};
    const Run run = to_run(given_run);
    run.check();
    auto uses = std::make_unique<Uses>(batch_.agents(), commands);
    is_long_ = batch_.takes_longer(kShortBatch, commands, run);
    // The arrays must exist until the end.
    arrays_ = {acts,       observes,     velocities, noises, poses,
               pose_rates, sensor_poses, ranges,     touched};
    // Safe without the GIL: the worlds are in use.
    batch_.start(commands, run, rows, is_long_ ? num_threads : 1);
    uses_ = std::move(uses);
  }

  void observe(const std::vector<std::size_t>& rows) {
    if (!uses_) throw py::value_error("the batch has not begun");
    for (const std::size_t row : rows) {
      check_row(row);
      if (batch_.is_chosen(row)) throw py::value_error("the agent acts, or is observed already");
      // Safe with other threads at work: the world and the rows are those of this agent only.
      World::ExclusiveUse use(*batch_.agents()[row].world, World::kStepping);
      batch_.observe(row);
    }
  }

  void stop_threads() {
    if (uses_) throw py::value_error("`finish` was not called");
    batch_.stop_threads();
  }

  py::list finish() {
    if (!uses_) throw py::value_error("the batch has not begun");
    const std::unique_ptr<Uses> uses = std::move(uses_);
    const auto unfinished = without_gil_if(is_long_, *uses, [&] { return batch_.finish(); });
    arrays_.clear();
    py::list list;
    for (const UnfinishedRun& each : unfinished) {
      py::object result = each.error ? error_of(each.error) : py::cast(result_tuple(each.result));
      list.append(py::make_tuple(each.agent, std::move(result)));
    }
    return list;
  }

 private:
  // Exclusive uses of the worlds of the agents that act or are observed; they end together.
  class Uses {
   public:
    Uses(const std::vector<Agent>& agents, const AgentCommands& commands) {
      const World* last = nullptr;
      for (std::size_t i = 0; i < agents.size(); ++i) {
        World& world = *agents[i].world;
        if ((!commands.acts[i] && !commands.observes[i]) || &world == last) continue;
        uses_.emplace_back(world, World::kStepping);
        last = &world;
      }
    }
    void end() { uses_.clear(); }

   private:
    std::deque<World::ExclusiveUse> uses_;
  };

  // Throws a ValueError unless a batch may contain both agents.
  static void check_beside(const Agent& agent, const Agent& other) {
    if (other.finder->readings() != agent.finder->readings()) {
      throw py::value_error("the agents of a batch must have equal numbers of readings");
    }
    if (other.world == agent.world && other.body == agent.body) {
      throw py::value_error("the agents of a batch must have different bodies");
    }
  }

  static std::vector<Agent> to_agents(const std::vector<PyAgent>& given) {
    if (given.empty()) throw py::value_error("a batch requires an agent");
    std::vector<Agent> agents;
    for (const PyAgent& each : given) {
      Agent agent = to_agent(each);
      for (const Agent& other : agents) {
        check_beside(agent, other);
        if (other.world == agent.world && agents.back().world != agent.world) {
          throw py::value_error("the agents of a world must be neighbours in a batch");
        }
      }
      agents.push_back(std::move(agent));
    }
    return agents;
  }

  void check_row(std::size_t row) const {
    if (row >= batch_.agents().size()) throw py::index_error("there is no such agent");
  }

  std::vector<PyWorld> worlds_;
  // From `start` to `finish`.
  std::vector<py::object> arrays_;
  std::unique_ptr<Uses> uses_;
  bool is_long_ = false;
  AgentBatch batch_;  // completes what it has begun before the members above end
};

// Computations on the arrays of a flatland.gym.Situation.
class PyAgentRows {
 public:
  PyAgentRows(Rows<double> poses, Rows<double> velocities, Rows<double> goals,
              Rows<double> goal_ahead, Rows<double> goal_left, Rows<double> distance,
              Rows<double> speed, Rows<double> yaw_rate, Rows<bool> arrived,
              Rows<double> previous_distance, Rows<bool> collided, Rows<float> ranges)
      : poses_(std::move(poses)),
        velocities_(std::move(velocities)),
        goals_(std::move(goals)),
        goal_ahead_(std::move(goal_ahead)),
        goal_left_(std::move(goal_left)),
        distance_(std::move(distance)),
        speed_(std::move(speed)),
        yaw_rate_(std::move(yaw_rate)),
        arrived_(std::move(arrived)),
        previous_distance_(std::move(previous_distance)),
        collided_(std::move(collided)),
        ranges_(std::move(ranges)) {
    if (poses_.ndim() != 2 || ranges_.ndim() != 2) {
      throw py::value_error("poses and ranges must have two dimensions");
    }
    check_rows(poses_, count(), 3, "poses");
    check_rows(velocities_, count(), 3, "velocities");
    check_rows(goals_, count(), 2, "goals");
    check_rows(goal_ahead_, count(), 1, "goal_ahead");
    check_rows(goal_left_, count(), 1, "goal_left");
    check_rows(distance_, count(), 1, "distance");
    check_rows(speed_, count(), 1, "speed");
    check_rows(yaw_rate_, count(), 1, "yaw_rate");
    check_rows(arrived_, count(), 1, "arrived");
    check_rows(previous_distance_, count(), 1, "previous_distance");
    check_rows(collided_, count(), 1, "collided");
    check_rows(ranges_, count(), static_cast<std::size_t>(ranges_.shape(1)), "ranges");
  }

  void locate(double goal_radius) { flatland::locate(places(), goal_radius); }
  void write_scans(double length, double half, py::array_t<float>& out) {
    const ObservationColumns columns = columns_of(out);
    const auto beams = static_cast<std::size_t>(ranges_.shape(1));
    if (columns.count == 0 || beams % columns.count != 0) {
      throw py::value_error("the number of columns must divide the number of beams");
    }
    flatland::write_scans(ranges_.data(), count(), beams, static_cast<float>(length),
                          static_cast<float>(half), columns);
  }
  void write_goals(double scale, py::array_t<float>& out) {
    flatland::write_goals(places(), scale, columns_of(out, 3));
  }
  void write_velocities(double max_speed, double max_yaw_rate, py::array_t<float>& out) {
    flatland::write_velocities(places(), max_speed, max_yaw_rate, columns_of(out, 2));
  }
  py::array_t<double> rewards(const std::vector<std::pair<int, double>>& given) {
    std::vector<RewardTerm> terms;
    for (const auto& [what, factor] : given) {
      if (what < 0 || what >= kRewardedCount) {
        throw py::value_error("there is no rewarded quantity " + std::to_string(what));
      }
      terms.push_back({static_cast<Rewarded>(what), factor});
    }
    py::array_t<double> out(static_cast<py::ssize_t>(count()));
    flatland::write_rewards(places(), terms, out.mutable_data());
    return out;
  }

 private:
  std::size_t count() const { return static_cast<std::size_t>(poses_.shape(0)); }

  AgentPlaces places() {
    return {count(),
            poses_.data(),
            velocities_.data(),
            goals_.data(),
            goal_ahead_.mutable_data(),
            goal_left_.mutable_data(),
            distance_.mutable_data(),
            speed_.mutable_data(),
            yaw_rate_.mutable_data(),
            arrived_.mutable_data(),
            previous_distance_.data(),
            collided_.data()};
  }

  // A view of columns of a C-contiguous array; `expected` is 0 for any number.
  ObservationColumns columns_of(py::array_t<float>& out, py::ssize_t expected = 0) const {
    constexpr auto kSize = static_cast<py::ssize_t>(sizeof(float));
    const bool fits = out.ndim() == 2 && out.shape(0) == poses_.shape(0) &&
                      (expected == 0 || out.shape(1) == expected) &&
                      (out.shape(1) < 2 || out.strides(1) == kSize) && out.strides(0) >= 0 &&
                      out.strides(0) % kSize == 0;
    if (!fits) throw py::value_error("out must have a row of float32 for each agent");
    return {out.mutable_data(), static_cast<std::size_t>(out.strides(0) / kSize),
            static_cast<std::size_t>(out.shape(1))};
  }

  Rows<double> poses_, velocities_, goals_, goal_ahead_, goal_left_, distance_, speed_, yaw_rate_;
  Rows<bool> arrived_;
  Rows<double> previous_distance_;
  Rows<bool> collided_;
  Rows<float> ranges_;
};

void bind_agent_rows(py::module_& module) {
  py::class_<PyAgentRows>(module, "AgentRows", R"(
Computations on the arrays of agents for learning, with a row for each of n agents.
)")
      .def(py::init<Rows<double>, Rows<double>, Rows<double>, Rows<double>, Rows<double>,
                    Rows<double>, Rows<double>, Rows<double>, Rows<bool>, Rows<double>, Rows<bool>,
                    Rows<float>>(),
           py::kw_only(), py::arg("poses").noconvert(), py::arg("velocities").noconvert(),
           py::arg("goals").noconvert(), py::arg("goal_ahead").noconvert(),
           py::arg("goal_left").noconvert(), py::arg("distance").noconvert(),
           py::arg("speed").noconvert(), py::arg("yaw_rate").noconvert(),
           py::arg("arrived").noconvert(), py::arg("previous_distance").noconvert(),
           py::arg("collided").noconvert(), py::arg("ranges").noconvert(), R"(
Keeps the arrays, which are those of a `flatland.gym.Situation`.

Raises:
    ValueError: An array has another number of rows or columns.
)")
      .def("locate", &PyAgentRows::locate, py::arg("goal_radius"), R"(
Computes the arrays that follow from poses, velocities and goals.

Args:
    goal_radius: Distance to the goal at which an agent has arrived [m].
)")
      .def("write_scans", &PyAgentRows::write_scans, py::arg("length"), py::arg("half"),
           py::arg("out").noconvert(), R"(
Writes scaled ranges, of which each column combines as many neighbours to the nearest one.

Args:
    length: Range that is written as 1, as is no hit [m].
    half: Range that is written as 0.5 [m]; 0 for a linear scale.
    out: Columns of observations, shape (n, size), float32; `size` divides the number of beams.

Raises:
    ValueError: `out` has another shape.
)")
      .def("write_goals", &PyAgentRows::write_goals, py::arg("scale"), py::arg("out").noconvert(),
           R"(
Writes the scaled distance of the goal, and the cosine and sine of its bearing.

Args:
    scale: Distance that is written as 1 [m].
    out: Columns of observations, shape (n, 3), float32.

Raises:
    ValueError: `out` has another shape.
)")
      .def("write_velocities", &PyAgentRows::write_velocities, py::arg("max_speed"),
           py::arg("max_yaw_rate"), py::arg("out").noconvert(), R"(
Writes forward speed and yaw rate, divided by their limits.

Args:
    max_speed: Speed that is written as 1 [m/s].
    max_yaw_rate: Yaw rate that is written as 1 [rad/s].
    out: Columns of observations, shape (n, 2), float32.

Raises:
    ValueError: `out` has another shape.
)")
      .def("rewards", &PyAgentRows::rewards, py::arg("terms"), R"(
Returns the sums of rewarded quantities, each multiplied by a factor.

Args:
    terms: Quantities and factors, which are added up in this order. The quantities are 0: how much
        closer to the goal the agent is than before the step [m], 1: whether it has arrived,
        2: whether it collided, 3: the number 1.

Returns:
    The rewards, shape (n,).

Raises:
    ValueError: There is no such quantity.
)");
}

}  // namespace

void bind_agents(py::module_& module) {
  bind_agent_rows(module);
  py::class_<PyAgentBatch>(module, "AgentBatch", R"(
Driven bodies with range finders, in worlds that advance in parallel.
)")
      .def(py::init<const std::vector<PyAgent>&>(), py::arg("agents"), R"(
Creates a batch of n agents.

Args:
    agents: For each agent a body, the controller of its velocity, the collector of its contacts,
        and a range finder.

Raises:
    ValueError: The agents of a world are not neighbours, two agents have the same body, their
        numbers of readings differ, or a range finder measures intensities.
)")
      .def("replace", &PyAgentBatch::replace, py::arg("row"), py::arg("agent"), R"(
Replaces an agent by one of another world, which has no permission. All agents of a world must be
replaced before `start`.

Args:
    row: Index of the agent.
    agent: As for the constructor.

Raises:
    IndexError: There is no such agent.
    ValueError: As for the constructor.
)")
      .def("permit", &PyAgentBatch::permit, py::arg("row"), R"(
Permits to step the world of an agent without any code in between.

The permission ends with `JobQueue.interrupt` of the world. To be called before the caller examines
whether there is such code, so that later changes withdraw the permission.

Args:
    row: Index of the agent.

Raises:
    IndexError: There is no such agent.
)")
      .def("withdraw", &PyAgentBatch::withdraw, py::arg("row"), R"(
Withdraws the permission of an agent.

Args:
    row: Index of the agent.

Raises:
    IndexError: There is no such agent.
)")
      .def("not_permitted", &PyAgentBatch::not_permitted, py::arg("acts").noconvert(), R"(
Returns the agents without a permission.

Args:
    acts: Agents that are examined, shape (n,).

Raises:
    ValueError: The array has another shape.
)")
      .def("start", &PyAgentBatch::start, py::arg("run"), py::arg("acts").noconvert(),
           py::arg("observes").noconvert(), py::arg("velocities").noconvert(),
           py::arg("noises").noconvert(), py::arg("poses").noconvert(),
           py::arg("pose_rates").noconvert(), py::arg("sensor_poses").noconvert(),
           py::arg("ranges").noconvert(), py::arg("touched").noconvert(), py::arg("num_threads"),
           R"(
Sets the commands of agents, and begins to step their worlds and to observe them.

Other threads do this until `finish`. Meanwhile these worlds and the arrays must not be used, except
for the rows of agents that neither act nor are observed. All arrays are C-contiguous, with a row for
each agent. The results do not depend on the number of threads.

Args:
    run: The steps, as `Run`; each world has a time of its own, which it advances if the steps are
        complete.
    acts: Whether the agent has a command, and its world steps, shape (n,).
    observes: Whether the agent is observed, after the steps of its world, shape (n,).
    velocities: Commands (forward, sideways, omega), or (speed, 0, steering angle) for a drive that is
        steered [m/s, rad/s, rad], shape (n, 3).
    noises: Stream and number of the update of each scan, shape (n, 2).
    poses: Receives (x, y, theta) of the bodies in the world frame, shape (n, 3).
    pose_rates: Receives the velocities of their origins (vx, vy, omega), shape (n, 3).
    sensor_poses: Receives the poses of the range finders in the world frame, shape (n, 3).
    ranges: Receives the readings [m], shape (n, readings), float32.
    touched: Receives whether an agent that acts touched anything in the steps, shape (n,).
    num_threads: Maximum number of threads; 0 for one per core.

Raises:
    ValueError: An array has another shape, a number is out of range, or `finish` was not called.
    StaleHandleError: A world is closed.
    WorldLockedError: A world is in use.
)")
      .def("observe", &PyAgentBatch::observe, py::arg("rows"), R"(
Observes agents between `start` and `finish` whose worlds these do not concern.

Args:
    rows: Indices of the agents.

Raises:
    IndexError: There is no such agent.
    ValueError: `start` was not called, it concerns one of the agents, or the pose of an agent is
        out of range.
    StaleHandleError: A world is closed.
    WorldLockedError: A world is in use.
)")
      .def("stop_threads", &PyAgentBatch::stop_threads, R"(
Ends the threads of the batch; `start` creates new ones.

Raises:
    ValueError: `finish` was not called.
)")
      .def("finish", &PyAgentBatch::finish, R"(
Completes what `start` has begun.

Returns:
    The first agents of worlds whose steps are not complete, with what `JobQueue.run` returns or
    raises. No agents of these worlds are observed.

Raises:
    ValueError: `start` was not called.
)");
}

}  // namespace flatland
