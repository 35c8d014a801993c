#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/tuples.h"
#include "bindings/values.h"
#include "crowd/crowd.h"
#include "crowd/gait.h"
#include "crowd/orca.h"
#include "crowd/social_force.h"
#include "crowd/walls.h"
#include "crowd/ways.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

using crowd::Crowd;
using crowd::Settings;

Crowd& changed_crowd(const CrowdHandle& handle) {
  World& world = handle.core();
  world.check_changeable();
  Crowd* crowd = world.jobs().find_crowd(handle.id);
  if (crowd == nullptr) throw StaleHandleError("the crowd was removed");
  return *crowd;
}

crowd::Person& changed_person(Crowd& crowd, Id body) {
  crowd::Person* person = crowd.find(body);
  if (person == nullptr) throw py::value_error("the body is not that of a person of the crowd");
  return *person;
}

Vec to_vec(const PyPoint& point) {
  if (!std::isfinite(point[0]) || !std::isfinite(point[1])) {
    throw py::value_error("coordinates must be finite");
  }
  return {point[0], point[1]};
}

PyPair to_pair(Vec v) { return {v.x, v.y}; }

std::optional<std::tuple<double, double, double, double>> to_bounds(
    const std::optional<crowd::Box>& box) {
  if (!box) return std::nullopt;
  return std::tuple(box->low.x, box->low.y, box->high.x, box->high.y);
}

std::uint32_t checked_index(std::uint32_t index, std::size_t count, const char* what) {
  if (index >= count) throw py::value_error(std::string(what) + " does not exist");
  return index;
}

// Sets parameters by name.
void set_numbers(Settings& settings, const std::map<std::string, double>& numbers) {
  crowd::SocialForces& forces = settings.forces;
  const std::map<std::string, double*> places{
      {"relaxation_time", &forces.relaxation_time},
      {"strength", &forces.strength},
      {"range", &forces.range},
      {"look_ahead", &forces.look_ahead},
      {"relative", &forces.relative},
      {"behind", &forces.behind},
      {"half_view", &forces.half_view},
      {"wall_strength", &forces.wall_strength},
      {"wall_range", &forces.wall_range},
      {"gaze", &forces.gaze},
      {"cohesion", &forces.cohesion},
      {"spacing", &forces.spacing},
      {"horizon", &settings.horizon},
      {"wall_horizon", &settings.wall_horizon},
      {"fluctuation", &settings.fluctuation},
      {"sight", &settings.sight},
      {"cell", &settings.cell},
      {"clearance", &settings.clearance},
      {"leg_radius", &settings.leg_radius},
      {"leg_spacing", &settings.leg_spacing},
  };
  for (const auto& [name, number] : numbers) {
    const auto place = places.find(name);
    if (place == places.end()) throw py::value_error("unknown parameter \"" + name + "\"");
    if (!(number >= 0.0) || std::isinf(number)) {
      throw py::value_error(name + " must be finite and not negative");
    }
    *place->second = number;
  }
  for (const char* name :
       {"relaxation_time", "range", "wall_range", "horizon", "wall_horizon", "cell"}) {
    if (*places.at(name) <= 0.0) throw py::value_error(std::string(name) + " must be positive");
  }
  forces.derive();
}

crowd::Person to_person(World& world, const py::handle& member) {
  const auto id_of = [&](const py::handle& body) {
    const Id id = id_in(world, body.cast<const BodyHandle&>());
    world.change_body(id);  // throws if it does not exist
    return id;
  };
  crowd::Person person;
  person.body = id_of(member.attr("body"));
  const py::sequence legs = member.attr("legs");
  if (legs.size() != 0 && legs.size() != 2) throw py::value_error("a person has two legs or none");
  for (std::size_t i = 0; i < legs.size(); ++i) person.legs[i] = id_of(py::object(legs[i]));
  person.radius = member.attr("radius").cast<double>();
  person.speed = member.attr("speed").cast<double>();
  person.is_aware = member.attr("is_aware").cast<bool>();
  person.phase = member.attr("phase").cast<double>();
  person.phase -= std::floor(person.phase);
  person.is_redrawn = member.attr("is_redrawn").cast<bool>();
  if (!(person.radius > 0.0) || !(person.speed > 0.0)) {
    throw py::value_error("radius and speed must be positive");
  }
  return person;
}

CrowdHandle add_crowd(const PyWorld& world, bool is_orca, bool is_dynamic, std::int64_t bits,
                      std::int64_t interval, std::uint64_t key,
                      const std::map<std::string, double>& numbers) {
  world.core->check_changeable();
  Settings settings;
  settings.model = is_orca ? Settings::Model::kOrca : Settings::Model::kSocialForce;
  settings.is_dynamic = is_dynamic;
  settings.bits = checked_bits(bits, "bits");
  if (interval < 1) throw py::value_error("interval must be at least 1 step");
  settings.interval = interval;
  settings.key = key;
  set_numbers(settings, numbers);
  return {world, world.core->jobs().add_crowd(settings)};
}

std::uint32_t add_waypoint(const CrowdHandle& handle, const PyPoint& low, const PyPoint& high,
                           double radius, const PyPoint& wait, bool is_queue, double spacing,
                           bool temporary) {
  crowd::Waypoint waypoint;
  waypoint.place = {to_vec(low), to_vec(high), radius};
  waypoint.wait = {wait[0], wait[1]};
  waypoint.is_queue = is_queue;
  waypoint.spacing = spacing;
  waypoint.is_temporary = temporary;
  return changed_crowd(handle).add_waypoint(waypoint);
}

std::uint32_t add_route(const CrowdHandle& handle, std::vector<std::uint32_t> waypoints,
                        const std::string& order, double stop_interval, const PyPoint& stop,
                        const std::optional<std::tuple<double, double, double, double>>& area) {
  Crowd& crowd = changed_crowd(handle);
  if (waypoints.empty()) throw py::value_error("a route needs waypoints");
  for (const std::uint32_t waypoint : waypoints) {
    checked_index(waypoint, crowd.waypoint_count(), "the waypoint");
  }
  crowd::Route route;
  route.waypoints = std::move(waypoints);
  using Order = crowd::Route::Order;
  route.order = chosen<Order>(order, "order",
                              {{"loop", Order::kLoop},
                               {"back_and_forth", Order::kBackAndForth},
                               {"random", Order::kRandom},
                               {"once", Order::kOnce}});
  route.stop_interval = stop_interval;
  route.stop = {stop[0], stop[1]};
  if (area) {
    const auto [x_min, y_min, x_max, y_max] = *area;
    route.low = to_vec({x_min, y_min});
    route.high = to_vec({x_max, y_max});
  }
  return crowd.add_route(route);
}

void add_party(const CrowdHandle& handle, std::uint32_t route, std::uint32_t first_leg,
               const PyMembers& members) {
  Crowd& crowd = changed_crowd(handle);
  checked_index(route, crowd.route_count(), "the route");
  checked_index(first_leg, crowd.route_size(route), "the waypoint of the route");
  if (members.empty()) throw py::value_error("a party needs members");
  std::vector<crowd::Person> people;
  for (const py::handle member : members) people.push_back(to_person(handle.core(), member));
  crowd.add_party(route, first_leg, people);
}

std::optional<Id> send(const CrowdHandle& handle, const Bodies& bodies, const PyPoint& place,
                       double radius) {
  Crowd& crowd = changed_crowd(handle);
  const std::vector<Id> ids = ids_in(handle.core(), bodies);
  for (const Id body : ids) changed_person(crowd, body);
  const Id stranded = crowd.send(handle.core(), ids, {to_vec(place), to_vec(place), radius});
  return stranded == 0 ? std::nullopt : std::optional(stranded);
}

std::vector<PyPersonState> read_people(const CrowdHandle& handle) {
  Crowd& crowd = changed_crowd(handle);
  std::vector<PyPersonState> people;
  for (const crowd::Person& person : crowd.people()) {
    const Triple pose = pose_of(handle.core(), person.body);
    const Triple velocity = velocity_of(handle.core(), person.body);
    people.push_back(make_value<PyPersonState>(person.body, pose[0], pose[1], pose[2], velocity[0],
                                               velocity[1], velocity[2],
                                               crowd.is_standing(person)));
  }
  return people;
}

void bind_steps_of(py::class_<CrowdHandle, Handle>& crowd) {
  crowd.def(
      "remove",
      [](const CrowdHandle& self) {
        changed_crowd(self);
        self.core().jobs().remove_crowd(self.id);
      },
      "Removes the crowd; the bodies keep their velocities.");
  crowd.def(
      "set_place",
      [](const CrowdHandle& self, std::int64_t order, std::int64_t number) {
        changed_crowd(self).place = JobPlace{order, number};
        self.core().jobs().place_changed();
      },
      py::arg("order"), py::arg("number"),
      "Sets the place of the crowd in the order of a step; see `JobQueue`.");
}

void bind_places(py::class_<CrowdHandle, Handle>& crowd) {
  crowd.def("add_waypoint", &add_waypoint, py::arg("low"), py::arg("high"), py::arg("radius"),
            py::kw_only(), py::arg("wait") = py::make_tuple(0.0, 0.0), py::arg("is_queue") = false,
            py::arg("spacing") = 0.7, py::arg("temporary") = false, R"(
Adds a waypoint: the points within a distance of a rectangle, which may be a point.

Args:
    low: Corner of the rectangle with the least coordinates [m], world frame.
    high: The opposite corner.
    radius: The distance [m].
    wait: Shortest and longest duration for which people wait there [s].
    is_queue: Whether people queue in front of the place and wait there one by one.
    spacing: Distance of people in the queue [m].
    temporary: Whether the waypoint is on no route; the next temporary waypoint replaces it.

Returns:
    The number of the waypoint.

Raises:
    ValueError: A coordinate is not finite.
)");
  crowd.def("add_route", &add_route, py::arg("waypoints"), py::arg("order"), py::kw_only(),
            py::arg("stop_interval") = 0.0, py::arg("stop") = py::make_tuple(0.0, 0.0),
            py::arg("area") = py::none(), R"(
Adds a route and returns its number.

Args:
    waypoints: Numbers of the waypoints.
    order: The order in which they are visited: `loop`, `back_and_forth`, `random` or `once`.
    stop_interval: Mean time between two stops on the way [s], 0 for none.
    stop: Shortest and longest duration of a stop [s].
    area: Area (x_min, y_min, x_max, y_max) of the places that `redraw` draws [m], world frame; None
        for the area of the walls, which must exist then.

Raises:
    ValueError: A waypoint or the order does not exist, or a coordinate is not finite.
)");
  crowd.def(
      "reach",
      [](const CrowdHandle& self, std::uint32_t waypoint) {
        Crowd& changed = changed_crowd(self);
        checked_index(waypoint, changed.waypoint_count(), "the waypoint");
        return changed.reach_of(self.core(), waypoint);
      },
      py::arg("waypoint"),
      R"(
Returns the number of cells of the planning grid from which a way leads to a waypoint.

It is 1 for a waypoint outside of the walls, to which no way is computed before it is needed.

Raises:
    PhysicsError: The grid would have too many cells.
)");
  crowd.def_property_readonly(
      "region",
      [](const CrowdHandle& self) { return to_bounds(changed_crowd(self).region(self.core())); },
      R"(
The part (x_min, y_min, x_max, y_max) of the world for which ways are computed [m].

None for the whole world. In a world that is too large, it is that of the waypoints and the walls
around them; without waypoints, that of the most walls that belong together.

Raises:
    PhysicsError: The grid would have too many cells.
)");
  crowd.def(
      "walls_apart_from",
      [](const CrowdHandle& self, const PyPoint& at) {
        const Vec point = to_vec(at);
        return to_bounds(changed_crowd(self).walls_apart_from(self.core(), {point, point}));
      },
      py::arg("place"), R"(
Returns the bounds of the walls if a place is outside of them, more than 1 m away.

Args:
    place: The place [m], world frame.

Returns:
    Bounds (x_min, y_min, x_max, y_max) of the walls near the people [m], None if the place is not
    outside or there are no walls.

Raises:
    PhysicsError: The grid would have too many cells.
)");
  crowd.def(
      "way",
      [](const CrowdHandle& self, std::uint32_t waypoint, const PyPoint& place) {
        Crowd& changed = changed_crowd(self);
        checked_index(waypoint, changed.waypoint_count(), "the waypoint");
        return to_pair(changed.way_from(self.core(), waypoint, to_vec(place)));
      },
      py::arg("waypoint"), py::arg("place"),
      R"(
Returns the direction of the way from a place to a waypoint, (0, 0) if there is none.

Raises:
    PhysicsError: The grid would have too many cells.
)");
}

void bind_people(py::class_<CrowdHandle, Handle>& crowd) {
  crowd.def("add_party", &add_party, py::arg("route"), py::arg("first_leg"), py::arg("members"), R"(
Adds people who walk together, or a single person.

Args:
    route: Number of the route.
    first_leg: Index of the first waypoint in the route.
    members: The people, at least one.

Raises:
    ValueError: The route or the waypoint does not exist, or a number is out of range.
)");
  crowd.def(
      "stop",
      [](const CrowdHandle& self, const BodyHandle& body, bool is_stopped) {
        const Id id = id_in(self.core(), body);
        crowd::Person& person = changed_person(changed_crowd(self), id);
        person.is_stopped = is_stopped;
        person.sent_to = crowd::kNone;
      },
      py::arg("body"), py::arg("is_stopped"),
      "Stops a person, or makes the person return to the route.");
  crowd.def("send", &send, py::arg("bodies"), py::arg("place"), py::arg("radius"), R"(
Makes people walk to a place and stop there, all of them or none.

Args:
    bodies: Bodies of the people.
    place: The place [m], world frame.
    radius: Distance at which the place is reached [m].

Returns:
    None, or the id of the body of a person from whom there is no way to the place.

Raises:
    ValueError: A coordinate is not finite, or a body is not that of a person.
    PhysicsError: The grid would have too many cells; nobody is sent.
)");
  crowd.def(
      "set_key",
      [](const CrowdHandle& self, std::uint64_t key) { changed_crowd(self).set_key(key); },
      py::arg("key"), "Sets the integer from which all further random numbers derive.");
  crowd.def(
      "redraw",
      [](const CrowdHandle& self) {
        const Id stranded = changed_crowd(self).redraw(self.core());
        return stranded == 0 ? std::nullopt : std::optional(stranded);
      },
      R"(
Draws new places, headings and first waypoints for the people with `Member.is_redrawn`.

The people stand there and begin their routes again. The places are at some distance from walls,
bodies and other people, and there is a way from them to the first waypoint of the route. They are a
function of the key, the walls, and the poses of other bodies and people.

Returns:
    None, or the id of the body of a person for whom there is no free place. Nothing is changed then.
)");
  crowd.def_property_readonly("people", &read_people,
                              "All people in the order in which they were added.");
  crowd.def_property_readonly(
      "state",
      [](const CrowdHandle& self) {
        const std::vector<double> state = changed_crowd(self).state();
        return py::array_t<double>(static_cast<py::ssize_t>(state.size()), state.data());
      },
      "Everything besides the bodies that affects the future, as numbers.");
}

// The formulas of the models, for tests.
void bind_formulas(py::module_& module) {
  using Numbers = std::map<std::string, double>;
  using PyDisc = std::tuple<PyPoint, PyPoint, double>;
  module.def(
      "crowd_repulsion",
      [](const PyPoint& offset, const PyPoint& velocity, const Numbers& numbers) {
        Settings settings;
        set_numbers(settings, numbers);
        return to_pair(crowd::repulsion(settings.forces, to_vec(offset), to_vec(velocity)));
      },
      py::arg("offset"), py::arg("velocity"), py::arg("numbers"));
  module.def(
      "crowd_wall_repulsion",
      [](const PyPoint& offset, double radius, const Numbers& numbers) {
        Settings settings;
        set_numbers(settings, numbers);
        return to_pair(crowd::wall_repulsion(settings.forces, to_vec(offset), radius));
      },
      py::arg("offset"), py::arg("radius"), py::arg("numbers"));
  module.def(
      "crowd_avoid",
      [](const PyDisc& disc, const PyDisc& other, double horizon, double share, double dt) {
        const auto to_disc = [](const PyDisc& d) {
          return crowd::Disc{to_vec(std::get<0>(d)), to_vec(std::get<1>(d)), std::get<2>(d)};
        };
        const crowd::HalfPlane plane =
            crowd::avoid(to_disc(disc), to_disc(other), horizon, share, dt);
        return std::pair{to_pair(plane.normal), plane.offset};
      },
      py::arg("disc"), py::arg("other"), py::kw_only(), py::arg("horizon"), py::arg("share"),
      py::arg("dt"));
  module.def(
      "nearest_point",
      [](const std::vector<std::pair<PyPoint, double>>& planes, const PyPoint& preferred,
         double radius, std::size_t hard) {
        std::vector<crowd::HalfPlane> half_planes;
        for (const auto& [normal, offset] : planes) half_planes.push_back({to_vec(normal), offset});
        return to_pair(crowd::nearest_point(half_planes, hard, radius, to_vec(preferred)));
      },
      py::arg("planes"), py::arg("preferred"), py::kw_only(), py::arg("radius"),
      py::arg("hard") = 0);
  using PySegments = std::vector<std::pair<PyPoint, PyPoint>>;
  const auto to_walls = [](const PySegments& pairs, double reach) {
    std::vector<crowd::Segment> segments;
    for (const auto& [a, b] : pairs) segments.push_back({to_vec(a), to_vec(b)});
    return crowd::Walls(segments, reach);
  };
  module.def(
      "crowd_near_walls",
      [to_walls](const PySegments& segments, double reach, const PyPoint& place, double range) {
        const crowd::Walls walls = to_walls(segments, reach);
        std::vector<crowd::NearPoint> found;
        walls.find_near(to_vec(place), range, found);
        std::vector<double> distances;
        for (const crowd::NearPoint& each : found) distances.push_back(each.distance);
        return std::pair{distances, walls.distance(to_vec(place), range)};
      },
      py::arg("segments"), py::arg("reach"), py::arg("place"), py::arg("distance"));
  module.def(
      "crowd_is_clear",
      [to_walls](const PySegments& segments, const PyPoint& a, const PyPoint& b) {
        return to_walls(segments, 0.0).is_clear(to_vec(a), to_vec(b));
      },
      py::arg("segments"), py::arg("a"), py::arg("b"));
  module.def(
      "crowd_is_hidden",
      [to_walls](const PySegments& segments, const PyPoint& place, const PyPoint& low,
                 const PyPoint& high) {
        return to_walls(segments, 0.0).is_hidden(to_vec(place), to_vec(low), to_vec(high));
      },
      py::arg("segments"), py::arg("place"), py::arg("low"), py::arg("high"));
  module.def(
      "crowd_is_in_view",
      [to_walls](const PySegments& segments, const PyPoint& place, const PyPoint& low,
                 const PyPoint& high) {
        return to_walls(segments, 0.0).is_in_view(to_vec(place), to_vec(low), to_vec(high));
      },
      py::arg("segments"), py::arg("place"), py::arg("low"), py::arg("high"));
  module.def(
      "crowd_doors",
      [to_walls](const PySegments& segments, const std::vector<PyPoint>& places) {
        constexpr double kClearance = 0.22;
        const auto walls = std::make_shared<const crowd::Walls>(
            to_walls(segments, crowd::FreeGrid::range(kClearance)));
        const Vec margin{1.0, 1.0};
        const crowd::Ways ways(
            crowd::FreeGrid(*walls, walls->low() - margin, walls->high() + margin, 0.1, kClearance),
            walls);
        std::vector<PyPair> centers;
        for (const crowd::Gate& gate : ways.gates()) centers.push_back(to_pair(gate.center));
        std::vector<std::vector<std::uint32_t>> in_view, others;
        for (const PyPoint& place : places) {
          const crowd::SegmentGrid::Indices seen = ways.gates_in_view(to_vec(place));
          const crowd::SegmentGrid::Indices further = ways.other_gates(to_vec(place));
          in_view.emplace_back(seen.begin(), seen.end());
          others.emplace_back(further.begin(), further.end());
        }
        return std::tuple{centers, in_view, others};
      },
      py::arg("segments"), py::arg("places"));
  module.def("step_length", &crowd::step_length, py::arg("speed"));
  module.def("leg_offset", &crowd::leg_offset, py::arg("phase"), py::arg("speed"));
}

}  // namespace

void bind_crowd(py::module_& module, Classes& classes) {
  classes.world.def("add_crowd", &add_crowd, py::kw_only(), py::arg("is_orca"),
                    py::arg("is_dynamic"), py::arg("bits"), py::arg("interval"), py::arg("key"),
                    py::arg("numbers"), R"(
Creates a crowd without people.

Args:
    is_orca: Whether velocities are chosen by ORCA, otherwise by the social force model.
    is_dynamic: Whether the bodies are dynamic, otherwise kinematic.
    bits: Bits of the layers whose walls and bodies people avoid.
    interval: Number of steps between two choices of velocities.
    key: A 64-bit integer from which all random numbers derive.
    numbers: Parameters of the models by name; see `src/cpp/crowd`.

Raises:
    ValueError: A parameter is unknown or out of range.
)");
  bind_steps_of(classes.crowd);
  bind_places(classes.crowd);
  bind_people(classes.crowd);
  bind_formulas(module);
}

}  // namespace flatland
