"""Checks that scenarios fit their worlds, before anything is run.

Every name must be that of something that exists at its time, every place must be one where the
robot can be, and every time must come before the end. Each world is loaded and prepared with the
first seed of its scenario. Only what is certain is an error: models that move are no obstacles, and
models that an event of unknown time may add exist.
"""

from __future__ import annotations

import itertools
import logging
import math
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from flatland.config import hints
from flatland.config.collecting_reader import ErrorCollector
from flatland.config.convert import Key
from flatland.config.reader import YamlReader
from flatland.errors import FlatlandError
from flatland.geometry import Vector2, compose
from flatland.loading.world_loader import load_world
from flatland.loading.world_source import WorldSource
from flatland.scenarios.events import Events
from flatland.scenarios.measures import PERSON
from flatland.scenarios.reader import Entry
from flatland.scenarios.scenario import Event, GeneratedWorld, RandomPlace, Run, Scenario, Trigger
from flatland.scenarios.stage import (
    Places,
    Stage,
    add_model,
    add_people,
    add_robot,
    find_people,
    find_robot,
    make_stage,
)
from flatland.scenarios.surroundings import Surroundings
from flatland.scenarios.worlds import world_file
from flatland.world import World

_LOG = logging.getLogger("flatland")

_PEOPLE: Final = "people"  # stands for all people in a condition
_ROBOT: Final = "robot"


def check_fit(
    entries: Sequence[Entry], collector: ErrorCollector, seeds: Sequence[int] | None = None
) -> None:
    """Checks scenarios of one file; warnings are logged with their places.

    Args:
        entries: The scenarios, without errors.
        collector: Collects the errors, also those of the files of worlds and models.
        seeds: Seeds in place of those of the scenarios.
    """
    references = _References()
    is_complete = True
    with tempfile.TemporaryDirectory(prefix="flatland") as folder:
        for entry in entries:
            seed = (seeds or entry.scenario.seeds)[0]
            is_loaded = False
            with collector.at(entry.reader.place):
                is_loaded = _check_entry(entry, seed, Path(folder), collector, references)
            is_complete = is_complete and is_loaded
    if is_complete:
        references.report(collector)


def _check_entry(
    entry: Entry, seed: int, folder: Path, collector: ErrorCollector, references: _References
) -> bool:
    """Checks a scenario; returns whether all of its files could be loaded."""
    scenario, found = entry.scenario, collector.found
    try:
        path = world_file(scenario, seed, folder)
    except ValueError as error:
        raise entry.reader.subnode("world").error(str(error)) from error
    source = WorldSource(path, params=dict(scenario.params), read=collector.read)
    try:
        world = load_world(World, source, seed=seed)
    except FlatlandError:
        raise
    except Exception:
        if collector.found == found:
            raise
        return False  # The result of values in place of the invalid ones.
    try:
        return collector.found == found and _Fit(entry, seed, world, collector).check(references)
    finally:
        with suppress(FlatlandError):
            world.close()


class _References:
    """What scenarios of one file refer to; an entry of the file may belong to several scenarios."""

    def __init__(self) -> None:
        # By the place and key of the entry: its error, and whether a scenario uses it.
        self._errors: dict[tuple[object, str], FlatlandError] = {}
        self._warnings: dict[tuple[object, str], FlatlandError] = {}
        self._used: set[tuple[object, str]] = set()

    def add(
        self,
        reader: YamlReader,
        name: str,
        is_used: bool,
        error: Callable[[], FlatlandError],
        *,
        is_warning: bool = False,
    ) -> None:
        """Adds a reference of one scenario, which is wrong if it is wrong in all of them."""
        key = (reader.place, name)
        if is_used:
            self._used.add(key)
        else:
            (self._warnings if is_warning else self._errors).setdefault(key, error())

    def report(self, collector: ErrorCollector) -> None:
        """Reports what is wrong in all scenarios."""
        for key, error in self._errors.items():
            if key not in self._used:
                collector.add(error)
        for key, error in self._warnings.items():
            if key not in self._used:
                _warn(error)


class _Fit:
    """Checks one scenario in its world."""

    def __init__(self, entry: Entry, seed: int, world: World, collector: ErrorCollector) -> None:
        self._scenario: Scenario = entry.scenario
        self._reader, self._inputs = entry.reader, entry.inputs
        self._run = Run(entry.scenario, "", seed)
        self._world = world
        self._collector = collector
        self._is_loaded = True
        self._is_at_start = False

    def check(self, references: _References) -> bool:
        """Reports everything that does not fit; returns whether all files could be loaded."""
        self._check_times()
        stage = self._prepare()
        if stage is not None:
            timeline = _Timeline(self._scenario, [one.name for one in self._world.models])
            around = Surroundings(self._world, stage.robot, timeline.changing)
            if self._is_at_start:
                self._check_places(stage, around)
            self._check_poses(stage, around)
            self._check_events(stage, timeline, around)
            self._check_contacts(timeline, references)
            self._check_conditions(references)
            self._check_params(references)
        return stage is not None and self._is_loaded

    # -- parts of the file -----------------------------------------------------------------

    def _sub(self, *keys: Key) -> YamlReader:
        """Returns a reader of an entry, or of its last parent that the file contains."""
        reader = self._reader
        for key in keys:
            reader_of_key = reader.optional_subnode(key) if not reader.is_scalar else reader
            if reader_of_key.is_null:
                return reader
            reader = reader_of_key
        return reader

    @contextmanager
    def _at(self, *keys: Key) -> Iterator[None]:
        """Reports an error of the block at an entry, unless it has a place of its own."""
        try:
            yield
        except FlatlandError as error:
            if error.place is not None:
                self._collector.add(error)
            else:
                self._error(error.message, *keys, hint=error.hint)
        except ValueError as error:
            self._error(str(error), *keys)

    def _error(self, message: str, *keys: Key, hint: str = "") -> None:
        self._collector.add(self._sub(*keys).error(message, hint))

    def _warn(self, message: str, *keys: Key, hint: str = "") -> None:
        _warn(self._sub(*keys).error(message, hint))

    # -- times -----------------------------------------------------------------------------

    def _check_times(self) -> None:
        scenario, step_size = self._scenario, self._world.timekeeper.step_size
        limit, goals = scenario.limits.time, len(scenario.goals)
        for index, event in enumerate(scenario.events):
            trigger = event.trigger
            if trigger.time is not None and trigger.time > limit - step_size / 2:
                self._error(
                    f"the event at {trigger.time:g} s never takes place: a run ends after "
                    f"{limit:g} s at the latest (limits: time)",
                    *("events", index, "at"),
                )
            if trigger.goals is not None and trigger.goals >= goals:
                self._error(
                    f"the event after goal {trigger.goals} never takes place: a run ends when the "
                    f"last goal is reached, and the scenario has {goals}",
                    *("events", index, "after_goal"),
                )
        stuck = scenario.limits.stuck
        if stuck is not None and stuck >= limit:
            self._warn(
                f'"stuck" has no effect: a run ends after {limit:g} s at the latest, got {stuck:g}',
                *("limits", "stuck"),
            )
        steps = scenario.robot.period / step_size
        if abs(steps - max(1, round(steps))) > 1e-6 * steps:
            self._warn(
                f'"period" must be a multiple of the step of {step_size:g} s, got '
                f"{scenario.robot.period:g}; {max(1, round(steps)) * step_size:g} s is used",
                *(_ROBOT, "period"),
            )

    # -- robot, models and people ----------------------------------------------------------

    def _prepare(self) -> Stage | None:
        """Prepares the world as for a run; returns None if that is not possible."""
        scenario, world, found = self._scenario, self._world, self._collector.found
        if isinstance(scenario.world, GeneratedWorld) and "pose" in self._sub(_ROBOT):
            self._error(
                "the robot has no pose in a random world, which places it; use start",
                *(_ROBOT, "pose"),
            )
        with self._at(_ROBOT, "model"):
            add_robot(world, scenario)
        if self._collector.found > found:
            return None
        with self._at(_ROBOT, "laser" if scenario.robot.laser else "name"):
            robot, laser = find_robot(world, scenario)
        if self._collector.found > found:
            return None
        for index, spawn in enumerate(scenario.models):
            with self._at("models", index):
                add_model(world, spawn)
        found = self._collector.found
        with self._at(_ROBOT):
            places = Places(world, robot, self._run.seed)
        if self._collector.found > found:
            return None
        start, goals = robot.pose, tuple[Vector2, ...]()
        with self._at("start"):
            start = places.start(scenario.start)
            world.move_model(robot.name, start, if_blocked="refuse")
            self._is_at_start = True
        people = find_people(world)
        for index, entry in enumerate(scenario.people):
            with self._at("people", index):
                add_people(world, people, entry)
        with self._at("goal" if "goal" in self._reader else "goals"):
            goals = places.goals(scenario.goals, start)
        stage = None
        with self._at(_ROBOT, "cmd_vel"):
            stage = make_stage(world, self._run, robot, laser, start, goals)
        return stage if goals else None

    # -- events ----------------------------------------------------------------------------

    def _check_events(self, stage: Stage, timeline: _Timeline, around: Surroundings) -> None:
        events = Events(self._scenario, stage)
        # The models first, so that all of them exist.
        for index, event in enumerate(self._scenario.events):
            if event.action == "spawn":
                self._check_spawn(index, event, stage, timeline)
        for index, event in enumerate(self._scenario.events):
            match event.action:
                case "delete" | "move":
                    self._check_model(index, event, stage, timeline)
                case "command":
                    self._check_command(index, event, events, timeline)
                case "people":
                    self._check_people(index, event, events, stage, around)
                case _:
                    pass

    def _check_spawn(self, index: int, event: Event, stage: Stage, timeline: _Timeline) -> None:
        spawn, world = event.values["spawn"], self._world
        place = ("events", index, "spawn")
        if timeline.surely_exists(spawn.name, index):
            self._error(
                f'a model "{spawn.name}" exists already; names must be different', *place, "name"
            )
            return
        pose = spawn.pose or compose(stage.robot.pose, (spawn.ahead, 0.0, 0.0))
        if spawn.name in {model.name for model in world.models}:  # It is deleted before.
            world.delete_model(spawn.name)
        found = self._collector.found
        with self._at(*place):
            world.spawn_model(spawn.model, spawn.name, pose=pose, if_blocked="allow")
        self._is_loaded = self._is_loaded and self._collector.found == found

    def _check_model(self, index: int, event: Event, stage: Stage, timeline: _Timeline) -> None:
        name, action = event.values["model"], event.action
        place = ("events", index, action, *(("model",) if action == "move" else ()))
        if name == stage.robot.name:
            other = "; use kidnap" if action == "move" else ""
            self._error(f'the model of "{action}" must not be the robot{other}', *place)
            return
        reason = timeline.absence(name, index)
        if reason:
            names = timeline.names - {stage.robot.name}
            hint = hints.did_you_mean(name, sorted(names), "models") if name not in names else ""
            self._error(f'model "{name}" {reason}', *place, hint=hint)

    def _check_command(self, index: int, event: Event, events: Events, timeline: _Timeline) -> None:
        topic, world = event.values["topic"], self._world
        topics = list(world.ports.commands)
        full = topic if topic.startswith("/") else f"/{topic}"
        place = ("events", index, "command")
        if full not in topics:
            self._error(
                f'no model or plugin has a command "{topic}"',
                *(*place, "topic"),
                hint=hints.did_you_mean(full, topics, "commands"),
            )
            return
        owners = _owners(world, full)
        absences = [timeline.absence(owner, index) for owner in owners]
        if owners and all(absences):
            self._error(
                f'model "{owners[0]}" with the command "{topic}" {absences[0]}', *place, "topic"
            )
            return
        with self._at(*place, "value"):
            events.carry_out(event)

    def _check_people(
        self, index: int, event: Event, events: Events, stage: Stage, around: Surroundings
    ) -> None:
        place, values = ("events", index, "people"), event.values
        if stage.people is None:
            self._error(f"the world {self._world.path} has no plugin Pedestrians", *place)
            return
        known = list(stage.people.people.names)
        unknown = [name for name in values["names"] or () if name not in known]
        for name in unknown:
            self._error(
                f'there is no person "{name}"',
                *(*place, values["action"]),
                hint=hints.did_you_mean(name, known, "people"),
            )
        if values["action"] == "send":
            regions = around.regions(stage.start[:2])
            problem = around.problem_at(values["goal"], regions)
            if problem:
                self._error(f"nobody can walk to {_shown(values['goal'])}: {problem}", *place, "to")
                return
        if not unknown:
            with self._at(*place):
                events.carry_out(event)

    # -- places ----------------------------------------------------------------------------

    def _check_places(self, stage: Stage, around: Surroundings) -> None:
        self._check_duration(stage)
        scenario, start = self._scenario, stage.start[:2]
        places = [scenario.start, *scenario.goals]
        if all(isinstance(one, RandomPlace) and one.area is None for one in places) and not any(
            event.action == "kidnap" or event.trigger.place for event in scenario.events
        ):
            return  # All places are drawn among those that the robot can reach.
        regions, kidnaps = around.regions(start), list(self._events("kidnap"))
        aims = frozenset[int]().union(*(around.regions(goal) for goal in stage.task.goals))
        problem = around.problem_at(start, aims)
        if problem:
            self._error(f"the robot cannot start at {_shown(start)}: {problem}", "start")
            return
        for index, event in kidnaps:
            pose = event.values["pose"]
            problem = around.problem_at(pose[:2], regions | aims)
            overlapped = around.overlapped_at(pose)
            if not problem and overlapped:
                problem = f"it overlaps {overlapped} there"
            if problem:
                message = f"the robot cannot be moved to {_shown(pose[:2])}: {problem}"
                self._error(message, "events", index, "kidnap")
        for _, event in kidnaps:
            regions |= around.regions(event.values["pose"][:2])
        for index, goal in enumerate(stage.task.goals):
            self._check_goal(index, goal, around, regions, start)
        for index, event in enumerate(scenario.events):
            place, radius = event.trigger.place, event.trigger.radius
            if place is not None and not around.reaches(regions, place, radius):
                problem = around.problem_at(place, regions) or around.narrow(start)
                self._error(
                    f"the event never takes place, the robot cannot come within {radius:g} m of "
                    f"{_shown(place)}: {problem}",
                    *("events", index, "near"),
                )

    def _check_poses(self, stage: Stage, around: Surroundings) -> None:
        for index, people in enumerate(self._scenario.people):
            for number, pose in enumerate(people.poses):
                problem = around.problem_at(pose[:2], around.regions(stage.start[:2]))
                if problem:
                    message = f"nobody can be at {_shown(pose[:2])}: {problem}"
                    self._error(message, "people", index, "poses", number)

    def _events(self, action: str) -> Iterator[tuple[int, Event]]:
        """Yields the events with an action, and their indices."""
        for index, event in enumerate(self._scenario.events):
            if event.action == action:
                yield index, event

    def _check_goal(
        self,
        index: int,
        goal: Vector2,
        around: Surroundings,
        regions: frozenset[int],
        start: Vector2,
    ) -> None:
        keys: tuple[Key, ...] = ("goal",) if "goal" in self._reader else ("goals", index)
        tolerance, wanted = self._scenario.tolerance, self._scenario.goals[index]
        problem = around.problem_at(goal, regions)
        if not problem and not around.reaches(regions, goal, tolerance):
            problem = around.narrow(start)
        if problem:
            # Otherwise, the scenario may be about what a robot does then.
            report = self._error if self._must_reach_goals else self._warn
            report(f"the goal {_shown(goal)} cannot be reached: {problem}", *keys)
        elif around.has_images and around.is_outside(goal):
            self._warn(f"the goal {_shown(goal)} is outside of {around.extent}", *keys)
        elif (
            index == 0
            and not isinstance(wanted, RandomPlace)
            and math.dist(start, goal) <= tolerance
        ):
            self._warn(
                f"the goal {_shown(goal)} is reached at once: it is within the tolerance of "
                f"{tolerance:g} m from the start {_shown(start)}",
                *keys,
            )
        elif index and wanted == self._scenario.goals[index - 1] and isinstance(wanted, tuple):
            self._warn(f"the goal {_shown(goal)} is reached at once, it is the one before", *keys)

    @property
    def _must_reach_goals(self) -> bool:
        """Whether a condition cannot hold unless all goals are reached."""
        goals = len(self._scenario.goals)
        return any(
            one.needs_success
            or (one.measure == "spl" and one.comparison in (">", ">="))
            or (one.measure == "goals" and one.limit == goals and one.comparison == ">=")
            for one in self._scenario.require
        )

    def _check_duration(self, stage: Stage) -> None:
        """Warns if even a straight way takes longer than a run may."""
        scenario = self._scenario
        if any(event.action == "kidnap" for event in scenario.events):
            return
        places = [stage.start[:2], *stage.task.goals]
        length = sum(
            max(0.0, math.dist(a, b) - 2 * scenario.tolerance)
            for a, b in itertools.pairwise(places)
        )
        # A command may have the largest speed ahead and to the side.
        fastest = length / (math.sqrt(2) * scenario.robot.max_speed)
        if fastest > scenario.limits.time:
            self._warn(
                f"the goals cannot be reached within {scenario.limits.time:g} s (limits: time), "
                f"with a largest speed of {scenario.robot.max_speed:g} m/s",
                *("limits", "time"),
            )

    # -- names in conditions, and parameters -----------------------------------------------

    def _check_contacts(self, timeline: _Timeline, references: _References) -> None:
        layers = [layer.name for layer in self._world.layers]
        people = [model.name for model in self._world.models if model.class_name == PERSON]
        known = {*layers, *timeline.names, *people, _PEOPLE}
        for index, condition in enumerate(self._scenario.require):
            name = condition.limit
            if not isinstance(name, str) or not name:
                continue
            reader = self._sub("require", index)

            def error(name: str = name, reader: YamlReader = reader) -> FlatlandError:
                return reader.error(
                    f'there is no model or layer "{name}"',
                    hints.did_you_mean(name, sorted(known), "models and layers"),
                )

            references.add(reader, name, name in known, error)

    def _check_conditions(self, references: _References) -> None:
        """Reports conditions that hold in no run."""
        limit = self._scenario.limits.time
        largest = {"spl": 1.0, "goals": float(len(self._scenario.goals)), "time": limit}
        largest |= dict.fromkeys(("stuck_time", "intrusion_time"), limit)
        for index, condition in enumerate(self._scenario.require):
            bound = condition.limit
            if isinstance(bound, str):
                continue
            most = largest.get(condition.measure, math.inf)
            least = self._world.timekeeper.step_size if condition.measure == "time" else 0.0
            holds = {
                "<": bound > least,
                "<=": bound >= least,
                ">": bound < most,
                ">=": bound <= most,
            }[condition.comparison]
            reader = self._sub("require", index)

            def error(
                text: str = condition.text,
                measure: str = condition.measure,
                least: float = least,
                most: float = most,
                reader: YamlReader = reader,
            ) -> FlatlandError:
                shown = f"at least {least:g}"
                if math.isfinite(most):
                    shown = f"from {least:g} to {most:g}"
                return reader.error(f'"{text}" cannot hold: {measure} is {shown}')

            references.add(reader, condition.text, holds, error)

    def _check_params(self, references: _References) -> None:
        of_world = set(self._world.source.inputs.params)
        # The expressions of the file itself use the matrix only.
        for key, used in (("matrix", of_world | set(self._inputs.params)), ("params", of_world)):
            reader = self._reader.optional_subnode(key, "map")
            for name in reader.keys():  # noqa: SIM118
                if name.startswith("."):
                    continue
                value = reader.subnode(name)

                def error(
                    key: str = key,
                    name: str = name,
                    value: YamlReader = value,
                    used: set[str] = used,
                ) -> FlatlandError:
                    kind = "parameters that are used" if used else ""
                    return value.error(
                        f'no file of the world or of its models uses the parameter "{name}" of '
                        f"{key}",
                        hints.did_you_mean(name, sorted(used), kind),
                    )

                references.add(value, name, name in used, error, is_warning=key == "params")


class _Timeline:
    """When models exist, as far as the triggers of events say.

    Attributes:
        names: Names of all models that exist at some time.
        changing: Names of models that events add, move or delete.
    """

    def __init__(self, scenario: Scenario, initial: Iterable[str]) -> None:
        self._events = scenario.events
        self._initial = set(initial)
        spawned = {event.values["spawn"].name for event in self._events if event.action == "spawn"}
        self.names = self._initial | spawned
        self.changing = spawned | {
            event.values["model"] for event in self._events if event.action in ("delete", "move")
        }

    def absence(self, name: str, index: int) -> str:
        """Returns why a model cannot exist at an event; empty if it may.

        Args:
            name: Name of the model.
            index: Index of the event.
        """
        if name not in self.names:
            return "does not exist"
        spawns = self._of("spawn", name)
        if name not in self._initial and all(self._is_before(index, one) for one in spawns):
            return f"is only added {_when(self._events[spawns[0]].trigger)}"
        deleted = [one for one in self._of("delete", name) if self._is_before(one, index)]
        for one in deleted:
            # It may have been added again in the meantime.
            if all(
                self._is_before(spawn, one) or self._is_before(index, spawn) for spawn in spawns
            ):
                return f"was deleted {_when(self._events[one].trigger)}"
        return ""

    def surely_exists(self, name: str, index: int) -> bool:
        """Returns whether a model exists when an event adds another one with its name."""
        if any(not self._is_before(index, one) for one in self._of("delete", name)):
            return False
        before = any(self._is_before(one, index) for one in self._of("spawn", name))
        return name in self._initial or before

    def _of(self, action: str, name: str) -> list[int]:
        """Returns the indices of the events that add or delete a model."""
        found = []
        for index, event in enumerate(self._events):
            values = event.values
            if event.action == action and name == (
                values["spawn"].name if action == "spawn" else values["model"]
            ):
                found.append(index)
        return found

    def _is_before(self, first: int, second: int) -> bool:
        """Returns whether an event surely takes place before another one, by their triggers."""
        if first == second:
            return False
        a, b = self._events[first].trigger, self._events[second].trigger
        if a.time is not None and b.time is not None:
            return (a.time, first) < (b.time, second)
        if a.goals is not None and b.goals is not None:
            return (a.goals, first) < (b.goals, second)
        return False


def _owners(world: World, topic: str) -> list[str]:
    """Returns the names of the models that have a command."""
    commands = world.ports.commands[topic]
    return [
        model.name
        for model in world.models
        for plugin in model.plugins
        if any(command.topic == topic and command in commands for command in plugin._commands)
    ]


def _when(trigger: Trigger) -> str:
    if trigger.time is not None:
        return f"at {trigger.time:g} s"
    if trigger.goals is not None:
        return f"after goal {trigger.goals}"
    return f"near {_shown(trigger.place or (0.0, 0.0))}"


def _shown(place: Vector2) -> str:
    return f"({place[0]:.4g}, {place[1]:.4g})"


def _warn(error: FlatlandError) -> None:
    _LOG.warning("%s", error.message, extra={"place": error.place, "hint": error.hint})
