"""Reads the models and events of a scenario."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

from flatland.config import hints
from flatland.config.reader import YamlReader
from flatland.scenarios.entries import choice, existing_file
from flatland.scenarios.scenario import FAULTS, Event, Spawn, Trigger

_TRIGGERS: Final = ("at", "near", "after_goal")
_PEOPLE: Final = ("stop", "resume", "send")


def read_model(entry: YamlReader) -> Spawn:
    """Reads a model that is added to the world before the start."""
    spawn = Spawn(
        name=entry.get("name", "string"),
        model=existing_file(entry, "model", "model"),
        pose=entry.get("pose", "pose", finite=True),
    )
    entry.ensure_accessed_all()
    return spawn


def _read_spawn(entry: YamlReader) -> Spawn:
    if "ahead" not in entry:
        return read_model(entry)
    spawn = Spawn(
        name=entry.get("name", "string"),
        model=existing_file(entry, "model", "model"),
        pose=None,
        ahead=entry.get("ahead", "float", finite=True),
    )
    entry.ensure_accessed_all()
    return spawn


def read_events(entries: YamlReader, robot: str) -> Iterator[Event]:
    """Yields the events of a list.

    Args:
        entries: The list.
        robot: Name of the robot, empty if it is not known yet.
    """
    for entry in entries.items():
        with entry.collect_errors():
            yield _read_event(entry, robot)


def _read_event(entry: YamlReader, robot: str) -> Event:
    trigger = _read_trigger(entry)
    actions = [key for key in entry.keys() if key in _ACTIONS]  # noqa: SIM118
    if len(actions) != 1:
        unknown = [key for key in entry.unread_keys() if key not in _ACTIONS]
        hint = hints.did_you_mean(unknown[0], _ACTIONS) if unknown else ""
        raise entry.error(f"an event must have one of the actions {', '.join(_ACTIONS)}", hint)
    (action,) = actions
    values = _ACTIONS[action](entry)
    if action in ("delete", "move") and robot and values["model"] == robot:
        other = "; use kidnap" if action == "move" else ""
        raise entry.error(f'the model of "{action}" must not be the robot{other}')
    entry.ensure_accessed_all()
    return Event(trigger, action, values, entry.place.suffix.strip(" []"))


def _read_trigger(entry: YamlReader) -> Trigger:
    given = [key for key in _TRIGGERS if key in entry]
    if len(given) != 1:
        raise entry.error(
            f"an event must have one of the triggers {', '.join(_TRIGGERS)}",
            "at: SECONDS, near: [x, y] of the robot, or after_goal: NUMBER",
        )
    (kind,) = given
    if kind == "at":
        return Trigger(time=entry.get("at", "float", finite=True, minimum=0))
    if kind == "after_goal":
        return Trigger(goals=entry.get("after_goal", "int", minimum=1))
    place = entry.get("near", "vector", finite=True)
    return Trigger(place=place, radius=entry.get("radius", "float", 1.0, minimum=0.01))


def _spawn(entry: YamlReader) -> dict[str, Any]:
    return {"spawn": _read_spawn(entry.subnode("spawn", "map"))}


def _delete(entry: YamlReader) -> dict[str, Any]:
    return {"model": entry.get("delete", "string")}


def _move(entry: YamlReader) -> dict[str, Any]:
    move = entry.subnode("move", "map")
    values = {
        "model": move.get("model", "string"),
        "pose": move.get("pose", "pose", finite=True),
        "keep_odometry": move.get("keep_odometry", "bool", False),
    }
    move.ensure_accessed_all()
    return values


def _kidnap(entry: YamlReader) -> dict[str, Any]:
    return {"pose": entry.get("kidnap", "pose", finite=True)}


def _command(entry: YamlReader) -> dict[str, Any]:
    command = entry.subnode("command", "map")
    values = {
        "topic": command.get("topic", "string"),
        "value": _typed(command.subnode("value").plain()),
    }
    command.ensure_accessed_all()
    return values


def _typed(value: Any) -> Any:
    """Returns a value of YAML with bools and numbers in place of their texts."""
    if isinstance(value, dict):
        return {key: _typed(part) for key, part in value.items()}
    if value in ("true", "false"):
        return value == "true"
    try:
        return float(value)
    except (TypeError, ValueError):
        return value


def _fail(entry: YamlReader) -> dict[str, Any]:
    fail = entry.subnode("fail", "map")
    fault = choice(fail, "how", FAULTS) if "how" in fail else FAULTS[0]
    values = {"fault": fault, "duration": fail.get("for", "float", None, minimum=0.001)}
    fail.ensure_accessed_all()
    return values


def _people(entry: YamlReader) -> dict[str, Any]:
    people = entry.subnode("people", "map")
    given = [key for key in _PEOPLE if key in people]
    if len(given) != 1:
        raise people.error(f"people must have one of the keys {', '.join(_PEOPLE)}")
    (action,) = given
    names = people.get_list(action, "string") if people.subnode(action).is_list else None
    if names is None and people.get(action, "string") != "all":
        raise people.invalid(action, 'must be a list of names, or "all"')
    goal = people.get("to", "vector", finite=True) if action == "send" else None
    people.ensure_accessed_all()
    return {"action": action, "names": names, "goal": goal}


_ACTIONS: Final[dict[str, Callable[[YamlReader], dict[str, Any]]]] = {
    "spawn": _spawn,
    "delete": _delete,
    "move": _move,
    "kidnap": _kidnap,
    "command": _command,
    "fail": _fail,
    "people": _people,
}
"""The actions of events by key; each returns the arguments of `flatland.scenarios.events`."""
