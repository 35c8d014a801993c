"""People who walk on their own and avoid walls, each other and robots."""

from __future__ import annotations

import importlib.util
import itertools
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.config.hints import did_you_mean
from flatland.errors import PhysicsError, WorldError
from flatland.geometry import DoubleArray, Vector2
from flatland.loading.model_source import ModelSpec
from flatland.physics import Member
from flatland.plugin_api.parameters import MAX_COORDINATE, read_choice, read_positive, read_rate
from flatland.plugin_api.plugin import WorldPlugin
from flatland.plugins._people_config import (
    BODY_TYPES,
    read_groups,
    read_legs,
)
from flatland.plugins._people_crowd import create_crowd, read_bits
from flatland.plugins._people_markers import MarkerSource, fields_of
from flatland.plugins._people_models import BODY, LEGS, model_text, parties_of, preferred_speeds
from flatland.plugins._people_places import PeoplePlaces
from flatland.suggestions import listed
from flatland.values import People, PeopleMarkers, PeopleStates, TrackedPeople

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.model import Model
    from flatland.plugin_api.ports import Output
    from flatland.plugins._people_config import Group
    from flatland.timekeeper import Timekeeper


_GOAL_RADIUS: Final = 0.3  # distance at which the goal of `send` is reached [m]


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
        self._redraws: bool = config.get("redraw", "bool", True)
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
                    self._spawn_anywhere(group, group.count)
            except WorldError as error:
                raise group.reader.error(f'group "{group.name}": {error.message}') from error

    def _draw_key(self) -> int:
        return int(self.rng.bit_generator.random_raw())

    def _open_ports(self, config: YamlReader) -> None:
        topic = config.get("topic", "string", "people")
        rate = read_rate(config, "pub_rate", 10.0)
        self._people = self.output(topic, People)
        self._states = self.output(f"{topic}/states", PeopleStates)
        self._markers = self.output(f"{topic}/markers", PeopleMarkers)
        self._marker_source = MarkerSource(self._groups)
        outputs: list[Output[Any]] = [self._people, self._states, self._markers]
        self._tracked: Output[TrackedPeople] | None = None
        if self.ros is not None and importlib.util.find_spec("people_msgs") is not None:
            self._tracked = self.output(f"{topic}/tracked", TrackedPeople)
            outputs.append(self._tracked)
        self.on_update(self._publish, rate, outputs=outputs)
        if self.ros is not None:
            self.ros.advertise_service(f"spawn_{topic}", "SpawnPeople", self._serve_spawn)
            self.ros.advertise_service(f"remove_{topic}", "RemovePeople", self._serve_remove)
            self.ros.advertise_service(f"direct_{topic}", "DirectPeople", self._serve_direct)

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
        """Makes people stand still until `resume` is called; None for everybody.

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
        """Makes people walk to a place [m] and stand there until `resume`; None for everybody.

        Raises:
            WorldError: There is no person of a name, or there is no way to the place, for example
                because it is outside of the walls.
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
        generator = self.rng.bit_generator
        before = generator.state
        try:
            if poses is not None:
                return self._spawn(chosen, np.array(poses, dtype=np.float64).reshape(-1, 3))
            if not 0 <= count <= 10000:
                raise ValueError(f"count must be from 0 to 10000, got {count}")
            return self._spawn_anywhere(chosen, count)
        except BaseException:
            generator.state = before
            raise

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
        shown = f"the goal ({place[0]:g}, {place[1]:g})"
        if max(abs(place[0]), abs(place[1])) > MAX_COORDINATE:
            raise WorldError(f"{shown} is beyond the greatest coordinate, {MAX_COORDINATE:g} m")
        try:
            stranded = self._crowd.send([_body(model) for model in models], place, _GOAL_RADIUS)
        except PhysicsError as error:
            raise WorldError(f"nobody can be sent to {shown}: {error}") from error
        if stranded is not None:
            name, _ = self._names[stranded]
            where = self._places.describe_outside(place)
            raise WorldError(f'there is no way for "{name}" to {shown}{where}')

    def _find_group(self, name: str | None) -> Group:
        for group in self._groups:
            if name in (None, "", group.name):
                return group
        names = [group.name for group in self._groups]
        raise WorldError(
            f'group "{name}" does not exist; groups: {listed(names)}',
            hint=did_you_mean(name or "", names),
        )

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
        """Returns the names of people and of their groups by the id of the body."""
        return {person.body_id: self._names[person.body_id] for person in self._crowd.people}

    def _spawn_anywhere(self, group: Group, count: int) -> list[str]:
        """Creates people of a group at random free places."""
        return self._spawn(group, self._places.find_free(group, count), is_redrawn=self._redraws)

    def _spawn(self, group: Group, poses: DoubleArray, *, is_redrawn: bool = False) -> list[str]:
        """Creates people of a group: all of them, or none.

        Args:
            group: The group.
            poses: Poses (x, y, theta) [m, rad], shape (n, 3).
            is_redrawn: Whether `randomize` draws other places.
        """
        count = len(poses)
        if not count:
            return []
        text = model_text(group, self._legs, self._layers, self._body_type, self._mass)
        parties = parties_of(poses[:, :2], group.together)
        speeds = preferred_speeds(group, count, self.rng)
        aware = self.rng.random(count) < self._awareness
        phases = self.rng.random(count)
        numbers = self._unused_numbers(group, count)
        names = [f"{group.name}_{number}" for number in numbers]
        models = self.world.spawn_models(
            [ModelSpec(text, name, "", pose) for name, pose in zip(names, poses, strict=True)],
            if_blocked="allow",
        )
        if models is None:
            raise WorldError("people cannot be spawned by a hook")
        self._numbers[group.name] = numbers[-1] + 1
        self._names = self._existing() | {
            _body(model).id: (model.name, group.name) for model in models
        }
        for party in parties:
            members = []
            for i in party:
                speed = speeds[party[0]] if group.together > 1 else speeds[i]
                legs = [leg.physics for leg in map(models[i].find_body, LEGS) if leg is not None]
                members.append(
                    Member(
                        _body(models[i]),
                        legs,
                        radius=group.radius,
                        speed=float(speed),
                        is_aware=bool(aware[i]),
                        phase=float(phases[i]),
                        is_redrawn=is_redrawn,
                    )
                )
            self._places.add_party(group, members)
        return names

    def _unused_numbers(self, group: Group, count: int) -> list[int]:
        """Returns the next numbers of a group that are in the name of no model."""
        used = {model.name for model in self.world.models}
        numbers = itertools.count(self._numbers[group.name])
        unused = (number for number in numbers if f"{group.name}_{number}" not in used)
        return list(itertools.islice(unused, count))

    # -- services --------------------------------------------------------------------------

    def _serve_spawn(self, request: Any) -> Any:
        poses = [(pose.x, pose.y, pose.theta) for pose in request.poses]
        try:
            names = self.spawn(request.group or None, request.count, poses or None)
        except (WorldError, ValueError) as error:
            return False, str(error), []
        return True, "", names

    def _serve_remove(self, request: Any) -> Any:
        try:
            self.remove(request.names or None)
        except WorldError as error:
            return False, str(error)
        return True, ""

    def _serve_direct(self, request: Any) -> Any:
        names = request.names or None
        try:
            if request.action == request.STOP:
                self.stop(names)
            elif request.action == request.RESUME:
                self.resume(names)
            elif request.action == request.SEND:
                self.send(names, (request.goal.x, request.goal.y))
            else:
                return False, f"action must be from 0 to 2, got {request.action}"
        except (WorldError, ValueError) as error:
            return False, str(error)
        return True, ""

    # -- steps -----------------------------------------------------------------------------

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits the people."""
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
        people = self._crowd.people
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

    def randomize(self, rng: np.random.Generator) -> None:
        """Draws new random numbers and, unless `redraw` is false, new places.

        Raises:
            WorldError: There are too few free places.
        """
        super().randomize(rng)
        stranded = self._crowd.redraw()
        if stranded is not None:
            name, group = self._names[stranded]
            raise WorldError(
                f'plugin "{self.name}": no free place for "{name}" of group "{group}" with a way '
                "to its waypoints"
            )

    def state(self) -> object:
        """Returns the state of the crowd, and the numbers of the next people."""
        return (self._crowd.state, sorted(self._numbers.items()))


def _body(model: Model) -> Any:
    body = model.find_body(BODY)
    if body is None:
        raise WorldError(f'model "{model.name}" is not a person')
    return body.physics
