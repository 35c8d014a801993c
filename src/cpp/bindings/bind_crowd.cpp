#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "crowd/crowd.h"
#include "crowd/gait.h"
#include "crowd/orca.h"
#include "crowd/social_force.h"
#include "world/bodies.h"
#include "world/errors.h"

namespace py = pybind11;

namespace flatland {
namespace {

using crowd::Crowd;
using crowd::Settings;
using crowd::Vec;
using Pair = std::pair<double, double>;

Crowd& changed_crowd(World& world, Id id) {
  world.check_changeable();
  Crowd* crowd = world.plan().find_crowd(id);
  if (crowd == nullptr) throw StaleHandleError("the crowd was removed");
  return *crowd;
}

crowd::Person& changed_person(Crowd& crowd, Id body) {
  crowd::Person* person = crowd.find(body);
  if (person == nullptr) throw py::value_error("the body is not that of a person of the crowd");
  return *person;
}

Vec to_vec(const Pair& pair) {
  if (!std::isfinite(pair.first) || !std::isfinite(pair.second)) {
    throw py::value_error("coordinates must be finite");
  }
  return {pair.first, pair.second};
}

Pair to_pair(Vec v) { return {v.x, v.y}; }

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
}

crowd::Route::Order order_of(const std::string& name) {
  using Order = crowd::Route::Order;
  if (name == "loop") return Order::kLoop;
  if (name == "back_and_forth") return Order::kBackAndForth;
  if (name == "random") return Order::kRandom;
  if (name == "once") return Order::kOnce;
  throw py::value_error("order must be one of: loop, back_and_forth, random, once, got \"" + name +
                        "\"");
}

void bind_parts(WorldClass& world) {
  world.def(
      "add_crowd_waypoint",
      [](World& self, Id id, const Pair& low, const Pair& high, double radius, const Pair& wait,
         bool is_queue, double spacing) {
        crowd::Waypoint waypoint;
        waypoint.place = {to_vec(low), to_vec(high), radius};
        waypoint.wait = {wait.first, wait.second};
        waypoint.is_queue = is_queue;
        waypoint.spacing = spacing;
        return changed_crowd(self, id).add_waypoint(waypoint);
      },
      py::arg("crowd"), py::arg("low"), py::arg("high"), py::arg("radius"), py::arg("wait"),
      py::arg("is_queue"), py::arg("spacing"));
  world.def(
      "add_crowd_route",
      [](World& self, Id id, std::vector<std::uint32_t> waypoints, const std::string& order,
         double stop_interval, const Pair& stop) {
        Crowd& crowd = changed_crowd(self, id);
        if (waypoints.empty()) throw py::value_error("a route needs waypoints");
        for (const std::uint32_t waypoint : waypoints) {
          checked_index(waypoint, crowd.waypoint_count(), "the waypoint");
        }
        crowd::Route route;
        route.waypoints = std::move(waypoints);
        route.order = order_of(order);
        route.stop_interval = stop_interval;
        route.stop = {stop.first, stop.second};
        return crowd.add_route(route);
      },
      py::arg("crowd"), py::arg("waypoints"), py::arg("order"), py::arg("stop_interval"),
      py::arg("stop"));
  world.def(
      "add_crowd_party",
      [](World& self, Id id, std::uint32_t route, std::uint32_t first_leg, bool is_backward) {
        Crowd& crowd = changed_crowd(self, id);
        checked_index(route, crowd.route_count(), "the route");
        checked_index(first_leg, crowd.route_size(route), "the waypoint of the route");
        return crowd.add_party(route, first_leg, is_backward);
      },
      py::arg("crowd"), py::arg("route"), py::arg("first_leg"), py::arg("is_backward"));
  world.def(
      "add_crowd_person",
      [](World& self, Id id, Id body, const std::pair<Id, Id>& legs, std::uint32_t party,
         double radius, double speed, bool is_aware, double phase) {
        Crowd& crowd = changed_crowd(self, id);
        checked_index(party, crowd.party_count(), "the party");
        if (!(radius > 0.0) || !(speed > 0.0)) {
          throw py::value_error("radius and speed must be positive");
        }
        self.change_body(body);  // throws if it does not exist
        crowd::Person person;
        person.body = body;
        person.legs[0] = legs.first;
        person.legs[1] = legs.second;
        person.party = party;
        person.radius = radius;
        person.speed = speed;
        person.is_aware = is_aware;
        person.phase = phase - std::floor(phase);
        return crowd.add_person(person);
      },
      py::arg("crowd"), py::arg("body"), py::arg("legs"), py::arg("party"), py::arg("radius"),
      py::arg("speed"), py::arg("is_aware"), py::arg("phase"));
}

void bind_people(WorldClass& world) {
  world.def("remove_crowd_person", [](World& self, Id id, Id body) {
    Crowd& crowd = changed_crowd(self, id);
    changed_person(crowd, body);
    crowd.remove_person(body);
  });
  world.def("stop_crowd_person", [](World& self, Id id, Id body, bool is_stopped) {
    crowd::Person& person = changed_person(changed_crowd(self, id), body);
    person.is_stopped = is_stopped;
    person.sent_to = crowd::kNone;
  });
  world.def("send_crowd_person", [](World& self, Id id, Id body, std::uint32_t waypoint) {
    Crowd& crowd = changed_crowd(self, id);
    crowd::Person& person = changed_person(crowd, body);
    person.sent_to = checked_index(waypoint, crowd.waypoint_count(), "the waypoint");
    person.is_stopped = false;
  });
  world.def("crowd_reach", [](World& self, Id id, std::uint32_t waypoint) {
    Crowd& crowd = changed_crowd(self, id);
    return crowd.reach_of(self, checked_index(waypoint, crowd.waypoint_count(), "the waypoint"));
  });
  world.def("crowd_way", [](World& self, Id id, std::uint32_t waypoint, const Pair& place) {
    Crowd& crowd = changed_crowd(self, id);
    checked_index(waypoint, crowd.waypoint_count(), "the waypoint");
    return to_pair(crowd.way_from(self, waypoint, to_vec(place)));
  });
  world.def("crowd_people", [](World& self, Id id) {
    Crowd& crowd = changed_crowd(self, id);
    py::list rows;
    for (const crowd::Person& person : crowd.people()) {
      if (!self.has_body(person.body)) continue;
      const Triple pose = pose_of(self, person.body);
      const Triple velocity = velocity_of(self, person.body);
      rows.append(py::make_tuple(person.body, pose[0], pose[1], pose[2], velocity[0], velocity[1],
                                 velocity[2], crowd.is_standing(person)));
    }
    return rows;
  });
  world.def("crowd_state", [](World& self, Id id) {
    const std::vector<double> state = changed_crowd(self, id).state();
    return py::array_t<double>(static_cast<py::ssize_t>(state.size()), state.data());
  });
}

void bind_formulas(py::module_& module) {
  module.def(
      "crowd_repulsion",
      [](const Pair& offset, const Pair& velocity, const std::map<std::string, double>& numbers) {
        Settings settings;
        set_numbers(settings, numbers);
        return to_pair(crowd::repulsion(settings.forces, to_vec(offset), to_vec(velocity)));
      },
      py::arg("offset"), py::arg("velocity"), py::arg("numbers"));
  module.def(
      "crowd_wall_repulsion",
      [](const Pair& offset, double radius, const std::map<std::string, double>& numbers) {
        Settings settings;
        set_numbers(settings, numbers);
        return to_pair(crowd::wall_repulsion(settings.forces, to_vec(offset), radius));
      },
      py::arg("offset"), py::arg("radius"), py::arg("numbers"));
  module.def(
      "crowd_avoid",
      [](const std::tuple<Pair, Pair, double>& disc, const std::tuple<Pair, Pair, double>& other,
         double horizon, double share, double dt) {
        const auto to_disc = [](const std::tuple<Pair, Pair, double>& d) {
          return crowd::Disc{to_vec(std::get<0>(d)), to_vec(std::get<1>(d)), std::get<2>(d)};
        };
        const crowd::HalfPlane plane =
            crowd::avoid(to_disc(disc), to_disc(other), horizon, share, dt);
        return py::make_tuple(to_pair(plane.normal), plane.offset);
      },
      py::arg("disc"), py::arg("other"), py::arg("horizon"), py::arg("share"), py::arg("dt"));
  module.def(
      "nearest_point",
      [](const std::vector<std::pair<Pair, double>>& planes, std::size_t hard, double radius,
         const Pair& preferred) {
        std::vector<crowd::HalfPlane> half_planes;
        for (const auto& [normal, offset] : planes) half_planes.push_back({to_vec(normal), offset});
        return to_pair(crowd::nearest_point(half_planes, hard, radius, to_vec(preferred)));
      },
      py::arg("planes"), py::arg("hard"), py::arg("radius"), py::arg("preferred"));
  module.def("step_length", &crowd::step_length, py::arg("speed"));
  module.def("leg_offset", &crowd::leg_offset, py::arg("phase"), py::arg("speed"));
}

}  // namespace

void bind_crowd(py::module_& module, WorldClass& world) {
  world.def(
      "add_crowd",
      [](World& self, bool is_orca, bool is_dynamic, std::int64_t bits, std::int64_t interval,
         std::uint64_t key, const std::map<std::string, double>& numbers) {
        self.check_changeable();
        Settings settings;
        settings.model = is_orca ? Settings::Model::kOrca : Settings::Model::kSocialForce;
        settings.is_dynamic = is_dynamic;
        settings.bits = checked_bits(bits, "bits");
        if (interval < 1) throw py::value_error("interval must be at least 1 step");
        settings.interval = interval;
        settings.key = key;
        set_numbers(settings, numbers);
        return self.plan().add_crowd(settings);
      },
      py::arg("is_orca"), py::arg("is_dynamic"), py::arg("bits"), py::arg("interval"),
      py::arg("key"), py::arg("numbers"));
  world.def("has_crowd", [](World& self, Id id) { return self.plan().find_crowd(id) != nullptr; });
  world.def("remove_crowd", [](World& self, Id id) {
    changed_crowd(self, id);
    self.plan().remove_crowd(id);
  });
  world.def(
      "schedule_crowd",
      [](World& self, Id id, std::int64_t order, bool is_automatic) {
        Crowd& crowd = changed_crowd(self, id);
        crowd.order = order;
        crowd.is_automatic = is_automatic;
        self.plan().order_changed();
      },
      py::arg("crowd"), py::arg("order"), py::arg("is_automatic"));
  world.def("advance_crowd", [](World& self, Id id, double dt) {
    self.plan().advance_now(self, changed_crowd(self, id), dt);
  });
  world.def("set_crowd_key",
            [](World& self, Id id, std::uint64_t key) { changed_crowd(self, id).set_key(key); });
  bind_parts(world);
  bind_people(world);
  bind_formulas(module);
}

}  // namespace flatland
