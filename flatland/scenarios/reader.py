"""Reads scenario files."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from flatland.config.convert import to_bool, to_float, to_int
from flatland.config.inputs import Inputs
from flatland.config.preprocessor import preprocess_file
from flatland.config.reader import ReadYaml, YamlReader, read_yaml
from flatland.errors import YamlError
from flatland.geometry import Vector2
from flatland.scenarios.conditions import Condition, ConditionError, parse_condition
from flatland.scenarios.entries import choice, existing_file
from flatland.scenarios.event_reader import read_events, read_model
from flatland.scenarios.scenario import (
    GeneratedWorld,
    Limits,
    People,
    RandomPlace,
    Robot,
    Scenario,
)
from flatland.scenarios.seeds import MAX_RUNS, parse_seeds
from flatland.worldgen.random_world import DEFAULT_RADIUS, DEFAULT_SIZE, KINDS

T = TypeVar("T")

_DEFAULT_CONDITION: Final = "reached"
_FIELD: Final = "."  # start of a key of the matrix that names a field


def is_scenario_file(path: str | os.PathLike[str]) -> bool:
    """Returns whether a file is a scenario: a map with goals or scenarios.

    A file that cannot be read or parsed is none.
    """
    try:
        root = _first_pass(os.fspath(path), {})
        return root.is_map and bool({"goal", "goals", "scenarios"} & set(root.keys()))
    except YamlError:
        return False


@dataclass(frozen=True, slots=True)
class Entry:
    """A scenario and its text.

    Attributes:
        scenario: The scenario.
        reader: The map that the scenario was read from, with the values of its matrix.
        inputs: Lists the parameters that expressions of the file have used.
    """

    scenario: Scenario
    reader: YamlReader
    inputs: Inputs


def read_scenarios(
    path: str | os.PathLike[str],
    params: Mapping[str, object] | None = None,
    read: ReadYaml = read_yaml,
) -> list[Scenario]:
    """Reads a scenario file; see `read_entries`."""
    return [entry.scenario for entry in read_entries(path, params, read)]


def read_entries(
    path: str | os.PathLike[str],
    params: Mapping[str, object] | None = None,
    read: ReadYaml = read_yaml,
) -> list[Entry]:
    """Reads a scenario file, one scenario for each entry and combination of its matrix.

    Args:
        path: The file.
        params: Values of `param()` in YAML files, which take precedence over those of the file.
        read: Loads the file; with `ErrorCollector.read`, errors are collected, and the scenarios
            that contain them are incomplete.

    Raises:
        YamlError: The file or a value in it is invalid.
    """
    file = os.fspath(path)
    given = dict(params or {})
    draft = _first_pass(file, given)
    count = len(draft.subnode("scenarios", "list")) if "scenarios" in draft else 1
    entries: list[Entry] = []
    roots: dict[tuple[tuple[str, str], ...], tuple[YamlReader, Inputs]] = {}
    combinations = [list(_combinations(_entry(draft, index))) for index in range(count)]
    # The expressions of other scenarios in the same file need values as well.
    firsts = {
        name: _plain(value.plain())
        for each in reversed(combinations)
        for name, value in each[0].items()
        if not name.startswith(_FIELD)
    }
    for index, of_entry in enumerate(combinations):
        for combination in of_entry:
            values = {k: v for k, v in combination.items() if not k.startswith(_FIELD)}
            texts = {name: _text(value) for name, value in values.items()}
            key = tuple(texts.items())
            if key not in roots:
                known = {name: _plain(value.plain()) for name, value in values.items()}
                inputs = Inputs(firsts | known | given, logs=not roots)
                roots[key] = (read(file, inputs), inputs)
            root, inputs = roots[key]
            fields = {k: v for k, v in combination.items() if k.startswith(_FIELD)}
            with root.collect_errors():
                reader = _with_fields(_entry(root, index), fields)
                variant = {name: _text(value) for name, value in combination.items()}
                scenario = _read_scenario(reader, file, variant, values, given)
                entries.append(Entry(scenario, reader, inputs))
    _check_names(draft, entries)
    return entries


def _first_pass(file: str, params: Mapping[str, object]) -> YamlReader:
    """Returns a reader of a file, some of whose expressions may not have a value yet."""
    inputs = Inputs(params, logs=False)
    return YamlReader(preprocess_file(file, inputs, on_error=lambda _error, _node: None))


def _entry(root: YamlReader, index: int) -> YamlReader:
    """Returns a reader of one scenario: the entries of the file, and those of the scenario."""
    if "scenarios" not in root:
        if not root.is_map:
            raise root.error("a scenario file must be a map with the keys world, goals and others")
        return root
    entry = root.subnode("scenarios", "list").subnode(index, "map")
    entries = {key: entry.subnode(key) for key in entry.keys()}  # noqa: SIM118
    return _replaced(root.without("scenarios"), entries)


def _replaced(reader: YamlReader, entries: Mapping[str, YamlReader]) -> YamlReader:
    """Returns a reader with other entries; `goal` and `goals` take the place of each other."""
    others = [a for a, b in (("goal", "goals"), ("goals", "goal")) if b in entries]
    return (reader.without(*others) if others else reader).updated(entries)


def _combinations(entry: YamlReader) -> Iterator[dict[str, YamlReader]]:
    """Yields the values of the matrix, by the names of parameters and fields."""
    matrix = entry.optional_subnode("matrix", "map")
    names = matrix.keys()
    lists = [list(matrix.subnode(name, "list").items()) for name in names]
    for name, values in zip(names, lists, strict=True):
        if not values:
            raise matrix.invalid(name, "must be a list of at least one value")
    count = 1
    for values in lists:
        count *= len(values)
    if count > MAX_RUNS:
        raise entry.invalid("matrix", f"must have at most {MAX_RUNS} combinations, got {count}")
    for combination in itertools.product(*lists):
        yield dict(zip(names, combination, strict=True))


def _with_fields(reader: YamlReader, fields: Mapping[str, YamlReader]) -> YamlReader:
    for path, value in fields.items():
        reader = _with_field(reader, path.removeprefix(_FIELD).split("."), value)
    return reader


def _with_field(reader: YamlReader, path: Sequence[str], value: YamlReader) -> YamlReader:
    first, *rest = path
    if rest:
        value = _with_field(reader.optional_subnode(first), rest, value)
    return _replaced(reader, {first: value})


def _text(value: YamlReader) -> str:
    plain = value.plain()
    return plain if isinstance(plain, str) else str(plain).replace("'", "").replace(" ", "")


def _plain(value: Any) -> object:
    """Returns a value as YAML does: a text that is a number or a bool is converted."""
    if not isinstance(value, str):
        return value
    for convert in (to_int, to_float, to_bool):
        try:
            return convert(value)
        except ValueError:
            continue
    return value


def _check_names(root: YamlReader, entries: Sequence[Entry]) -> None:
    titles = [entry.scenario.title for entry in entries]
    for title in titles:
        if titles.count(title) > 1:
            raise root.error(f'there are two scenarios "{title}"; names must be different')


# -- one scenario --------------------------------------------------------------------------


def _read_scenario(
    reader: YamlReader,
    file: str,
    variant: Mapping[str, str],
    values: Mapping[str, YamlReader],
    given: Mapping[str, object],
) -> Scenario:
    reader.optional_subnode("matrix")
    stem = Path(file).name.removesuffix(".yaml")
    name = reader.get("name", "string", "")
    own = reader.optional_subnode("params", "map")
    params = {key: _plain(own.subnode(key).plain()) for key in own.keys()}  # noqa: SIM118
    params |= {key: _plain(value.plain()) for key, value in values.items()}
    robot = _read_robot(reader)
    scenario = Scenario(
        name=f"{stem}/{name}" if name else stem,
        description=reader.get("description", "string", ""),
        file=file,
        world=_read_world(reader),
        robot=robot,
        start=_read_start(reader),
        goals=_read_goals(reader),
        tolerance=reader.get("tolerance", "float", 0.3, finite=True, minimum=0.01),
        models=tuple(_read_items(reader, "models", read_model)),
        people=tuple(_read_items(reader, "people", _read_people)),
        events=tuple(read_events(reader.optional_subnode("events", "list"), robot.name)),
        limits=_read_limits(reader.optional_subnode("limits", "map")),
        require=tuple(_read_conditions(reader)),
        params=params | dict(given),
        variant=variant,
        seeds=_read_seeds(reader),
    )
    reader.ensure_accessed_all()
    return scenario


def _read_items(reader: YamlReader, key: str, read: Callable[[YamlReader], T]) -> Iterator[T]:
    for item in reader.optional_subnode(key, "list").items():
        with item.collect_errors():
            yield read(item)


def _read_world(reader: YamlReader) -> str | GeneratedWorld:
    entry = reader.subnode("world")
    if not entry.is_map:
        return existing_file(reader, "world", "world")
    kind = choice(entry, "generate", KINDS)
    seed = None
    if "seed" in entry:
        seed = entry.get("seed", "int", minimum=0)
    width, height = entry.get("size", "vector", DEFAULT_SIZE, minimum=1, maximum=500)
    radius = entry.get("radius", "float", DEFAULT_RADIUS, minimum=0.1, maximum=0.45)
    entry.ensure_accessed_all()
    return GeneratedWorld(kind, seed, (width, height), radius)


def _read_robot(reader: YamlReader) -> Robot:
    entry = reader.optional_subnode("robot")
    if entry.is_scalar:
        return Robot(name=reader.get("robot", "string"))
    entry = reader.optional_subnode("robot", "map")
    known = Robot()
    has_model = "model" in entry
    model = existing_file(entry, "model", "model") if has_model else ""
    robot = Robot(
        name=entry.get("name", "string", "robot" if has_model else ""),
        model=model,
        pose=entry.get("pose", "pose", known.pose, finite=True) if has_model else known.pose,
        laser=entry.get("laser", "string", known.laser),
        cmd_vel=entry.get("cmd_vel", "string", known.cmd_vel),
        period=entry.get("period", "float", known.period, minimum=0.001, maximum=10),
        max_speed=entry.get("max_speed", "float", known.max_speed, minimum=0.01, maximum=100),
        max_turn=entry.get("max_turn", "float", known.max_turn, minimum=0.01, maximum=100),
    )
    entry.ensure_accessed_all()
    return robot


def _read_place(entry: YamlReader, is_goal: bool) -> RandomPlace:
    known = RandomPlace()
    least, most = known.distance
    if is_goal and "distance" in entry:
        if entry.subnode("distance").is_list:
            least, most = entry.get("distance", "vector", minimum=0)
        else:
            least = entry.get("distance", "float", finite=True, minimum=0)
        if entry.is_complete and most <= least:
            raise entry.invalid("distance", f"must be [least, most], got [{least:g}, {most:g}]")
    area = entry.get_list("area", "float", None, size=4, finite=True)
    if area is not None and not (area[0] < area[2] and area[1] < area[3]) and entry.is_complete:
        raise entry.invalid("area", f"must be [x_min, y_min, x_max, y_max], got {area}")
    place = RandomPlace(
        (least, most),
        entry.get("clearance", "float", known.clearance, finite=True, minimum=0),
        None if area is None else (area[0], area[1], area[2], area[3]),
    )
    entry.ensure_accessed_all()
    return place


def _is_random(entry: YamlReader) -> bool:
    return entry.is_map or entry.plain() == "random"


def _read_start(reader: YamlReader) -> Any:
    entry = reader.optional_subnode("start")
    if entry.is_null:
        return None
    if _is_random(entry):
        return _read_place(entry, is_goal=False) if entry.is_map else RandomPlace()
    return reader.get("start", "pose", finite=True)


def _read_goals(reader: YamlReader) -> tuple[Vector2 | RandomPlace, ...]:
    if "goal" in reader:
        if "goals" in reader:
            raise reader.subnode("goal").error('a scenario has "goal" or "goals", not both')
        return (_read_goal(reader, "goal"),)
    entries = reader.subnode("goals", "list")
    if not len(entries) and reader.is_complete:
        raise reader.invalid("goals", "must be a list of at least one goal")
    return tuple(_read_goal(entries, index) for index in range(len(entries)))


def _read_goal(reader: YamlReader, key: str | int) -> Vector2 | RandomPlace:
    entry = reader.subnode(key)
    if _is_random(entry):
        return _read_place(entry, is_goal=True) if entry.is_map else RandomPlace()
    return reader.get(key, "vector", finite=True)


def _read_people(entry: YamlReader) -> People:
    poses = tuple(
        entry.subnode("poses").get(index, "pose", finite=True)
        for index in range(len(entry.optional_subnode("poses", "list")))
    )
    count = 0 if "poses" in entry else entry.get("count", "int", minimum=0, maximum=10_000)
    people = People(entry.get("group", "string", ""), count, poses)
    entry.ensure_accessed_all()
    return people


def _read_limits(entry: YamlReader) -> Limits:
    known = Limits()
    collisions = known.collisions
    if "collisions" in entry:
        is_any = entry.subnode("collisions").plain() == "any"
        collisions = None if is_any else entry.get("collisions", "int", minimum=0)
    limits = Limits(
        entry.get("time", "float", known.time, minimum=0.1, maximum=1e6),
        collisions,
        entry.get("stuck", "float", known.stuck, minimum=0.1, maximum=1e6),
    )
    entry.ensure_accessed_all()
    return limits


def _read_conditions(reader: YamlReader) -> Iterator[Condition]:
    entries = reader.optional_subnode("require", "list")
    if entries.is_null:
        yield parse_condition(_DEFAULT_CONDITION)
        return
    for index, item in enumerate(entries.items()):
        with item.collect_errors():
            try:
                yield parse_condition(entries.get(index, "string"))
            except ConditionError as error:
                raise item.error(f"Invalid condition, {error}", error.hint) from error


def _read_seeds(reader: YamlReader) -> tuple[int, ...]:
    entry = reader.optional_subnode("seeds")
    if entry.is_null:
        return (0,)
    texts = entry.plain() if entry.is_list else [entry.plain()]
    try:
        return parse_seeds(",".join(map(str, texts)))
    except ValueError as error:
        raise reader.invalid("seeds", str(error)) from error
