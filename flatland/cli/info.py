"""`flatland info`: describes the contents of a world."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flatland.cli.arguments import Commands, add_command, file_arguments, load_world_or_model
from flatland.entities.body import Body
from flatland.entities.collision_filter import ALL_LAYERS
from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.geometry import bounds_of
from flatland.node.services import SERVICES
from flatland.plugin_api.plugin import FlatlandPlugin
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.plugin_api.updates import STEP_HOOKS
from flatland.world import World

_EXAMPLES = (
    "flatland info worlds/office/world.yaml",
    "flatland info worlds/office/diff_robot.model.yaml",
    "flatland info worlds/office/world.yaml --json",
)


@dataclass(frozen=True, slots=True)
class Topic:
    """An output or command of a world.

    Attributes:
        topic: Resolved name.
        direction: `out` for a publisher, `in` for a subscriber.
        type: Name of the Python class of the values.
        message: ROS message type, empty if there is none or ROS is not installed.
        rate: Rate of the values in simulated time [Hz], None if unknown.
        plugins: Names of the plugins, each as MODEL/PLUGIN or PLUGIN.
    """

    topic: str
    direction: str
    type: str
    message: str
    rate: float | None
    plugins: list[str]


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "info",
        parents=[file_arguments("FILE", "world or model file")],
        summary="describe the layers, models, topics, frames and services of a world",
        description="Loads a world or model and prints its layers, models, bodies with their "
        "masses, topics, coordinate frames and services. It is stepped to find the frames.",
        examples=_EXAMPLES,
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=_info)


def _info(options: argparse.Namespace) -> int:
    with load_world_or_model(options, seed=0) as world:
        contents = describe_world(world, str(options.path))
        # In the first step, most plugins send their first transforms.
        world.step(1 + _steps_to_first_updates(world))
        contents["frames"] = _describe_frames(world)
    if options.json:
        print(json.dumps(contents, indent=2))
    else:
        _print(contents)
    return 0


# -- contents ------------------------------------------------------------------------------


def describe_world(world: World, path: str) -> dict[str, Any]:
    """Returns the contents of a world as values of JSON.

    Args:
        world: The world. Its frames are known if it was stepped.
        path: The world file, as given.
    """
    return {
        "file": str(Path(path).absolute()),
        "layers": [_layer(layer) for layer in world.layers],
        "models": [_model(world, model) for model in world.models],
        "world_plugins": [_plugin(plugin) for plugin in world.plugins],
        "topics": [dataclasses.asdict(topic) for topic in topics(world)],
        "frames": _describe_frames(world),
        "services": [{"name": service.name, "type": service.type} for service in SERVICES],
    }


def _describe_frames(world: World) -> list[dict[str, str]]:
    return [{"parent": parent, "child": child} for parent, child in sorted(world.transforms)]


def _steps_to_first_updates(world: World) -> int:
    """Returns the number of steps in which plugins with `after_step` send their first transforms.

    Their first update is due one period after the start; at most one second is considered.
    """
    plugins = [plugin for model in world.models for plugin in model.plugins]
    rates = [rate for plugin in plugins if (rate := _rate(plugin))]
    step_size = world.timekeeper.step_size_ns / 1e9
    return math.ceil(min(1.0, 1 / min(rates, default=1.0)) / step_size)


def _layer(layer: Layer) -> dict[str, Any]:
    bounds = bounds_of(layer.world_edges.reshape(-1, 2))
    return {
        "names": list(layer.names),
        "edges": len(layer.edges),
        "exact_edges": layer.exact_edge_count,
        "bounds": None if bounds is None else [_rounded(number, 3) for number in bounds],
    }


def _model(world: World, model: Model) -> dict[str, Any]:
    return {
        "name": model.name,
        "namespace": model.namespace,
        "file": model.path,
        "pose": [_rounded(number, 4) for number in model.pose],
        "mass": _number(sum(body.mass for body in model.bodies)),
        "bodies": [_body(world, body) for body in model.bodies],
        "joints": [
            {"name": joint.name, "type": joint.type, "bodies": [b.name for b in joint.bodies]}
            for joint in model.joints
        ],
        "plugins": [_plugin(plugin) for plugin in model.plugins],
    }


def _body(world: World, body: Body) -> dict[str, Any]:
    layers: list[str] = []
    known = world.collision_filter
    for fixture in body.fixtures:
        bits = fixture.category_bits
        layers += ["all"] if bits == ALL_LAYERS else known.names_of(bits)
    return {
        "name": body.name,
        "type": body.type,
        "mass": _number(body.mass),
        "inertia": _number(body.inertia),
        "footprints": len(body.fixtures),
        "layers": list(dict.fromkeys(layers)),
    }


def _plugin(plugin: FlatlandPlugin) -> dict[str, Any]:
    return {"name": plugin.name, "type": plugin.type, "rate": _rate(plugin)}


def _rounded(value: float, decimals: int) -> float:
    return round(value, decimals) + 0.0  # Without the sign of -0.


def _number(value: float) -> float:
    return float(f"{value:.6g}")


def topics(world: World) -> list[Topic]:
    """Returns all topics of a world, sorted by name."""
    plugins = [plugin for model in world.models for plugin in model.plugins]
    found = []
    for topic, output in world.ports.outputs.items():
        owners = [plugin for plugin in (*plugins, *world.plugins) if output in plugin._outputs]
        rates = {_rate(plugin) for plugin in owners}
        rate = rates.pop() if len(rates) == 1 else None
        found.append(_topic(topic, "out", output.value_type, rate, owners))
    for topic, commands in world.ports.commands.items():
        owners = [
            plugin
            for plugin in (*plugins, *world.plugins)
            if any(command in plugin._commands for command in commands)
        ]
        found.append(_topic(topic, "in", commands[0].value_type, None, owners))
    return sorted(found, key=lambda entry: (entry.topic, entry.direction))


def _topic(
    topic: str,
    direction: str,
    value_type: type[Any],
    rate: float | None,
    owners: Iterable[FlatlandPlugin],
) -> Topic:
    names = [
        "/".join(filter(None, (getattr(getattr(plugin, "model", None), "name", ""), plugin.name)))
        for plugin in owners
    ]
    return Topic(topic, direction, value_type.__name__, _message_type(value_type), rate, names)


def _message_type(value_type: type[Any]) -> str:
    try:
        from flatland.ros.adapters import find_adapter

        adapter = find_adapter(value_type)
    except ImportError:  # ROS is not installed
        return ""
    return "" if adapter is None else str(adapter.message_type._type)


def _rate(plugin: FlatlandPlugin) -> float | None:
    """Returns the rate of the updates of a plugin [Hz]; None if it has none, or several."""
    timers = [value for value in vars(plugin).values() if isinstance(value, UpdateTimer)]
    # Hooks are called in every step and may check a timer.
    hooks = [getattr(plugin, hook) for hook in STEP_HOOKS.values()]
    timers += [update.timer for update in plugin.updates if update.function not in hooks]
    rates = {timer.rate for timer in timers}
    limited = rates - {math.inf}
    if not rates or len(limited) > 1:
        return None
    in_each_step = 1e9 / plugin.world.timekeeper.step_size_ns
    return min(*limited, in_each_step) if limited else in_each_step


# -- text ----------------------------------------------------------------------------------


def _print(contents: dict[str, Any]) -> None:
    print(contents["file"])
    _section(
        "layers",
        ("names", "edges", "without simplification", "x [m]", "y [m]"),
        [
            (
                ", ".join(layer["names"]),
                layer["edges"],
                layer["exact_edges"] if layer["exact_edges"] != layer["edges"] else "",
                *_ranges(layer["bounds"]),
            )
            for layer in contents["layers"]
        ],
    )
    _section(
        "models",
        ("model", "namespace", "pose [m, m, rad]", "mass [kg]", "joints", "plugins"),
        [
            (
                model["name"],
                model["namespace"],
                " ".join(f"{number:g}" for number in model["pose"]),
                f"{model['mass']:.4g}",
                ", ".join(f"{joint['name']} ({joint['type']})" for joint in model["joints"]),
                _names(model["plugins"]),
            )
            for model in contents["models"]
        ],
    )
    _section(
        "bodies",
        ("body", "type", "mass [kg]", "inertia [kg m²]", "footprints", "layers"),
        [
            (
                f"{model['name']}/{body['name']}",
                body["type"],
                f"{body['mass']:.4g}",
                f"{body['inertia']:.4g}",
                body["footprints"],
                ", ".join(body["layers"]),
            )
            for model in contents["models"]
            for body in model["bodies"]
        ],
    )
    if contents["world_plugins"]:
        print(f"\nworld plugins: {_names(contents['world_plugins'])}")
    _section(
        "topics",
        ("topic", "", "value", "ROS message", "rate [Hz]", "plugin"),
        [
            (
                topic["topic"],
                topic["direction"],
                topic["type"],
                topic["message"],
                "" if topic["rate"] is None else f"{topic['rate']:.4g}",
                ", ".join(topic["plugins"]),
            )
            for topic in contents["topics"]
        ],
    )
    print("\nframes")
    for line in frame_tree((frame["parent"], frame["child"]) for frame in contents["frames"]):
        print(f"  {line}")
    _section(
        "services of the ROS node",
        ("service", "type"),
        [(service["name"], service["type"]) for service in contents["services"]],
    )


def _ranges(bounds: Sequence[float] | None) -> tuple[str, str]:
    if bounds is None:
        return ("", "")
    x_min, y_min, x_max, y_max = bounds
    return (f"{x_min:g} to {x_max:g}", f"{y_min:g} to {y_max:g}")


def _names(plugins: Iterable[dict[str, Any]]) -> str:
    return ", ".join(f"{plugin['name']} ({plugin['type']})" for plugin in plugins)


def _section(title: str, head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Prints a table without its empty columns; nothing for a table without rows."""
    if not rows:
        return
    table = [list(head), *([str(cell) for cell in row] for row in rows)]
    columns = [i for i in range(len(head)) if any(row[i] for row in table[1:])]
    widths = {i: max(len(row[i]) for row in table) for i in columns}
    print(f"\n{title}")
    for row in table:
        print(("  " + "  ".join(f"{row[i]:{widths[i]}}" for i in columns)).rstrip())


def frame_tree(pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Returns the lines of a tree of frames.

    A frame with several parents occurs below each of them.

    Args:
        pairs: (parent, child) of each transform.
    """
    children: dict[str, list[str]] = {}
    for parent, child in sorted(pairs):
        children.setdefault(parent, []).append(child)
    below = {child for names in children.values() for child in names}
    # In a cycle, no frame is a root; start anywhere.
    roots = [parent for parent in children if parent not in below] or sorted(children)[:1]
    lines: list[str] = []

    def add_frame(frame: str, depth: int, path: tuple[str, ...]) -> None:
        lines.append("  " * depth + frame)
        for child in children.get(frame, ()):
            if child in path:
                lines.append("  " * (depth + 1) + f"{child} (cycle)")
            else:
                add_frame(child, depth + 1, (*path, child))

    for root in roots:
        add_frame(root, 0, (root,))
    return lines or ["none"]
