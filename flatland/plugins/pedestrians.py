"""People who walk on their own and avoid walls, each other and robots."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland.errors import WorldError
from flatland.geometry import DoubleArray, Vector2
from flatland.plugin_api.after_step import AFTER, BEFORE, NeverDue
from flatland.plugin_api.parameters import read_positive, read_rate
from flatland.plugin_api.plugin import WorldPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.plugins._people_config import (
    BODY_TYPES,
    read_choice,
    read_groups,
    read_legs,
)
from flatland.plugins._people_crowd import create_crowd, read_bits
from flatland.plugins._people_markers import MarkerSource, fields_of
from flatland.plugins._people_models import BODY, LEGS, model_text, parties_of, preferred_speeds
from flatland.plugins._people_places import PeoplePlaces
from flatland.plugins._people_services import PeopleServices
from flatland.values import People, PeopleMarkers, PeopleStates, TrackedPeople

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.model import Model
    from flatland.plugin_api.ports import Output
    from flatland.plugins._people_config import Group
    from flatland.timekeeper import Timekeeper


class Pedestrians(WorldPlugin):
    """Groups of people, whose bodies the core moves by the social force model or by ORCA.

    Each person is a model of the world, with a body and possibly two legs, so that lasers detect
    people, and viewers show, move and delete them like other models.
    """

    recorded_methods = frozenset(["spawn_people", "remove_people", "direct_people"])

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and creates the people."""
        self._groups = read_groups(config)
        self._legs = read_legs(config)
        self._layers: list[str] = config.get_list(
            "layers", "string", ["all"] if self._legs is None else []
        )
        self._body_type = read_choice(config, "body_type", BODY_TYPES)
        self._mass = read_positive(config, "mass", 75.0)
        self._awareness = config.get("robot_awareness", "float", 1.0, minimum=0, maximum=1)
        bits = read_bits(config, self.world, self._layers, self._legs, self._body_type)
        self._frame_id: str = config.get("world_frame_id", "string", "map")
        self._crowd = self.control(
            create_crowd(
                config,
                self.world,
                self._groups,
                self._legs,
                bits=bits,
                is_dynamic=self._body_type == "dynamic",
                key=self._draw_key(),
            )
        )
        self._places = PeoplePlaces(self._crowd, self.world, bits, self.rng)
        self._names: dict[int, tuple[str, str]] = {}  # of person and group by id of the body
        self._numbers = {group.name: 0 for group in self._groups}
        self._open_ports(config)
        for group in self._groups:
            try:
                self._places.add_route(group)
                if group.count:
                    self._spawn(group, self._places.find_free(group, group.count))
            except WorldError as error:
                raise group.reader.error(f'group "{group.name}": {error.message}') from error

    def _draw_key(self) -> int:
        return int(self.rng.integers(0, 1 << 64, dtype=np.uint64))

    def _open_ports(self, config: YamlReader) -> None:
        topic = config.get("topic", "string", "people")
        self._timer = UpdateTimer(read_rate(config, "pub_rate", 10.0))
        self._people = self.output(topic, People)
        self._states = self.output(f"{topic}/states", PeopleStates)
        self._markers = self.output(f"{topic}/markers", PeopleMarkers)
        self._marker_source = MarkerSource(self._groups)
        outputs: list[Output[Any]] = [self._people, self._states, self._markers]
        self._tracked: Output[TrackedPeople] | None = None
        if self.ros is not None and importlib.util.find_spec("people_msgs") is not None:
            self._tracked = self.output(f"{topic}/tracked", TrackedPeople)
            outputs.append(self._tracked)
        self.call_when_due(BEFORE, NeverDue())
        self.call_when_due(AFTER, self._timer, outputs=outputs)
        if self.ros is not None:
            PeopleServices(self).advertise(self.ros, topic)

    # -- people ----------------------------------------------------------------------------

    @property
    def people(self) -> PeopleStates:
        """Names, poses and velocities of all people now."""
        return self._read_people(self.world.timekeeper.sim_time_ns)

    def spawn(
        self,
        group: str | None = None,
        count: int = 1,
        poses: Sequence[Sequence[float]] | None = None,
    ) -> list[str]:
        """Adds people between two steps: all of them, or none.

        Args:
            group: Name of their group; None for the first one.
            count: Number of people at random free places.
            poses: Poses (x, y, theta) [m, rad] instead; they are not checked for obstacles.

        Returns:
            The names of the new people.

        Raises:
            WorldError: The group does not exist, or there are too few free places.
            ValueError: A pose is not finite, or the count is negative.
        """
        plain = None if poses is None else [tuple(map(float, pose)) for pose in poses]
        arguments = {"group": group, "count": count, "poses": plain}
        names: list[str] = self.world.call_plugin(self, "spawn_people", arguments)
        return names

    def remove(self, names: Iterable[str] | None = None) -> None:
        """Removes people between two steps: all of them, or none.

        Args:
            names: Their names; None for everybody.

        Raises:
            WorldError: There is no person of a name.
        """
        listed = None if names is None else list(names)
        self.world.call_plugin(self, "remove_people", {"names": listed})

    def stop(self, names: Iterable[str] | None = None) -> None:
        """Makes people stand still until `resume`; None for everybody.

        Raises:
            WorldError: There is no person of a name.
        """
        self._direct(names, "stop", None)

    def resume(self, names: Iterable[str] | None = None) -> None:
        """Makes people return to their routes; None for everybody.

        Raises:
            WorldError: There is no person of a name.
        """
        self._direct(names, "resume", None)

    def send(self, names: Iterable[str] | None, goal: Vector2) -> None:
        """Makes people walk to a place [m], and stand there until `resume`; None for everybody.

        Raises:
            WorldError: There is no person of a name, or nobody fits at the place.
            ValueError: The goal is not finite.
        """
        self._direct(names, "send", (float(goal[0]), float(goal[1])))

    def _direct(self, names: Iterable[str] | None, action: str, goal: Vector2 | None) -> None:
        listed = None if names is None else list(names)
        arguments = {"names": listed, "action": action, "goal": goal}
        self.world.call_plugin(self, "direct_people", arguments)

    # -- methods that recordings repeat ----------------------------------------------------

    def spawn_people(
        self, group: str | None, count: int, poses: Sequence[Sequence[float]] | None
    ) -> list[str]:
        """Carries out `spawn`."""
        chosen = self._find_group(group)
        if poses is None:
            if not 0 <= count <= 10000:
                raise ValueError(f"count must be from 0 to 10000, got {count}")
            if count == 0:
                return []
            return self._spawn(chosen, self._places.find_free(chosen, count))
        return self._spawn(chosen, np.array(poses, dtype=np.float64).reshape(-1, 3))

    def remove_people(self, names: list[str] | None) -> None:
        """Carries out `remove`."""
        models = self._find_people(names)
        self.world.delete_models([model.name for model in models])

    def direct_people(
        self, names: list[str] | None, action: str, goal: Sequence[float] | None
    ) -> None:
        """Carries out `stop`, `resume` and `send`."""
        models = self._find_people(names)
        if action != "send" or goal is None:
            for model in models:
                self._crowd.stop(_body(model), action == "stop")
            return
        place = (goal[0], goal[1])
        if not (math.isfinite(place[0]) and math.isfinite(place[1])):
            raise ValueError(f"the goal must be finite [m], got {place}")
        waypoint = self._places.add_goal(place)
        for model in models:
            if not self._places.has_way(waypoint, model.pose[:2]):
                raise WorldError(
                    f'there is no way for "{model.name}" to the goal ({goal[0]:g}, {goal[1]:g})'
                )
        for model in models:
            self._crowd.send(_body(model), waypoint)

    def _find_group(self, name: str | None) -> Group:
        for group in self._groups:
            if name in (None, "", group.name):
                return group
        known = ", ".join(group.name for group in self._groups)
        raise WorldError(f'group "{name}" does not exist; groups: {known}')

    def _find_people(self, names: list[str] | None) -> list[Model]:
        models = {
            name: self.world.model(name)
            for name in (person[0] for person in self._existing().values())
        }
        if names is None:
            return list(models.values())
        for name in names:
            if name not in models:
                raise WorldError(f'there is no person "{name}"')
        return [models[name] for name in names]

    def _existing(self) -> dict[int, tuple[str, str]]:
        """Returns the names of people and their groups, without those who were deleted."""
        return {
            person.body_id: self._names[person.body_id]
            for person in self._crowd.people
            if person.body_id in self._names
        }

    def _spawn(self, group: Group, poses: DoubleArray) -> list[str]:
        """Creates people of a group at poses (x, y, theta), shape (n, 3)."""
        self._names = self._existing()
        count = len(poses)
        number = self._numbers[group.name]
        names = [f"{group.name}_{number + i}" for i in range(count)]
        text = model_text(group, self._legs, self._layers, self._body_type, self._mass)
        parties = parties_of(poses[:, :2], group.together)
        speeds = preferred_speeds(group, count, self.rng)
        aware = self.rng.random(count) < self._awareness
        phases = self.rng.random(count)
        models = self._spawn_models(text, names, poses)
        self._numbers[group.name] += count
        for party in parties:
            party_number = self._places.add_party(group)
            for i in party:
                model = models[i]
                self._names[_body(model).id] = (model.name, group.name)
                legs = [leg for leg in map(model.find_body, LEGS) if leg is not None]
                self._crowd.add_person(
                    _body(model),
                    [leg.physics for leg in legs],
                    party_number,
                    radius=group.radius,
                    speed=float(speeds[party[0]]) if group.together > 1 else float(speeds[i]),
                    is_aware=bool(aware[i]),
                    phase=float(phases[i]),
                )
        return names

    def _spawn_models(self, text: str, names: list[str], poses: DoubleArray) -> list[Model]:
        """Adds the models of people: all of them, or none."""
        models: list[Model] = []
        try:
            for name, pose in zip(names, poses.tolist(), strict=True):
                model = self.world.spawn_model(text, name, "", pose, "allow")
                if model is None:
                    raise WorldError("people cannot be spawned by a hook")
                models.append(model)
        except BaseException:
            for model in models:
                self.world.delete_model(model.name)
            raise
        return models

    # -- steps -----------------------------------------------------------------------------

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Moves the people; the core does this without a call."""
        self._crowd.advance(timekeeper.step_size)

    @when_due
    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Emits the people at the rate of publication."""
        if not self._timer.check_update(timekeeper):
            return
        states = self._read_people(timekeeper.sim_time_ns)
        if self._people.wanted:
            self._people.emit(People(states.stamp, states.frame_id, states.names, states.poses))
        if self._states.wanted:
            self._states.emit(states)
        if self._markers.wanted:
            self._markers.emit(self._marker_source.make(states, list(self._existing())))
        if self._tracked is not None and self._tracked.wanted:
            self._tracked.emit(TrackedPeople(**fields_of(states)))

    def _read_people(self, stamp: int) -> PeopleStates:
        people = [person for person in self._crowd.people if person.body_id in self._names]
        rows = np.array([person[1:7] for person in people]).reshape(-1, 6)
        rows[:, 2] = np.remainder(rows[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        names = [self._names[person.body_id] for person in people]
        return PeopleStates(
            stamp,
            self._frame_id,
            tuple(name for name, _ in names),
            rows[:, :3],
            tuple(group for _, group in names),
            rows[:, 3:],
            np.array([person.is_standing for person in people], dtype=np.bool_),
        )

    def reseed(self, rng: np.random.Generator) -> None:
        """Continues all random numbers from a state that is drawn from a generator."""
        super().reseed(rng)
        self._crowd.set_key(self._draw_key())

    def state(self) -> object:
        """Returns the state of the crowd, and the numbers of the next people."""
        return (self._crowd.state, sorted(self._numbers.items()))


def _body(model: Model) -> Any:
    body = model.find_body(BODY)
    if body is None:
        raise WorldError(f'model "{model.name}" is not a person')
    return body.physics
