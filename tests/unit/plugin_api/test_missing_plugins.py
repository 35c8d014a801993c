"""Plugins that are declared by no manifest: one error for all of a world or model, with advice."""

from __future__ import annotations

import re

import pytest
from flatland_command import main

import flatland
from flatland import PluginError
from flatland.config.plugin_parameters import PARAMETERS, REQUIRED
from flatland.plugin_api.fork_plugins import ALTERNATIVES, alternative_to
from flatland.plugin_api.manifest import PORTING_GUIDE
from flatland.plugin_api.missing_plugins import MissingPluginsError
from flatland.plugin_api.registry import PluginRegistry

BODY = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}"

CPP_PACKAGE = """
<package format="2"><name>{name}</name><export>
  <{tag} plugin="${{prefix}}/plugins.xml"/>
</export></package>
"""
CPP_MANIFEST = """
<library path="lib/libhall">
  <class type="flatland_plugins::Elevator" base_class_type="flatland_server::ModelPlugin"/>
  <class name="hall::Door" type="hall_internal::Door"
         base_class_type="flatland_server::WorldPlugin"/>
</library>
"""


@pytest.fixture(autouse=True)
def _no_other_plugins(monkeypatch):
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("FLATLAND_PLUGIN_PATH", raising=False)


def write_model(files, name, *plugins):
    lines = [f"bodies: [{BODY}]", "plugins:", *(f"- {{{plugin}}}" for plugin in plugins)]
    return files.write(name, "\n".join(lines) + "\n")


def error_of(action, *arguments):
    with pytest.raises(MissingPluginsError) as caught:
        action(*arguments)
    return str(caught.value)


def find_error(type_name):
    with pytest.raises(PluginError) as caught:
        flatland.World(seed=1).plugin_host.registry.find(type_name)
    return str(caught.value)


def test_all_missing_plugins_of_a_world_are_in_one_error(files):
    a = write_model(files, "a.yaml", "name: up, type: Elevator", "name: eye, type: Lasser")
    b = write_model(files, "b.yaml", "name: d, type: Tween, body: base", 'name: g, type: "x::Gate"')
    text = """
    properties: {}
    layers: []
    models:
    - {name: one, model: a.yaml}
    - {name: two, model: b.yaml}
    - {name: three, model: a.yaml}
    plugins:
    - {name: A, type: RandomWall}
    - {name: W, type: Weather}
    - {name: off, type: Absent, enabled: false}
    """
    first, *others, advice = error_of(files.load, text).split("\n")
    world = files.folder / "world.yaml"
    assert [first, *others] == [
        'Flatland plugin: Model Plugin "up" type "Elevator" model "one", "three": no plugin '
        f'"flatland_plugins::Elevator" [{a}:3]',
        'Model Plugin "eye" type "Lasser" model "one", "three": no plugin '
        f'"flatland_plugins::Lasser" (did you mean "Laser"?) [{a}:4]',
        f'Model Plugin "g" type "x::Gate" model "two": no plugin "x::Gate" [{b}:4]',
        f'World Plugin "W" type "Weather": no plugin "flatland_plugins::Weather" [{world}:10]',
    ]
    assert advice.startswith("C++ plugins cannot be loaded, ")
    # Included plugins have no prefix, and dummy plugins are not listed.
    listed = advice.split("known plugins: ")[1].split(", ")
    known = [name for name in PluginRegistry().classes if "Dummy" not in name]
    assert sorted(listed) == sorted(name.removeprefix("flatland_plugins::") for name in known)


def test_an_invalid_file_does_not_hide_missing_plugins(files):
    write_model(files, "a.yaml", "name: p, type: Pump")
    files.write("broken.yaml", "bodies: [")
    text = """
    properties: {}
    layers: []
    models:
    - {name: one, model: a.yaml}
    - {name: two, model: broken.yaml}
    - {name: three, model: absent.yaml}
    - {name: four}
    - {name: five, model: minimal.model.yaml}
    plugins: [{name: x}, {name: W, type: Weather}]
    """
    message = error_of(files.load, text)
    assert '"p" type "Pump" model "one"' in message
    assert "Weather" not in message  # its list is invalid
    text = text.replace("{name: x}, ", "")
    assert '"W" type "Weather"' in error_of(files.load, text)


def test_spawning_reports_all_missing_plugins_of_a_model_and_starts_none(files, empty_world):
    path = write_model(
        files,
        "m.yaml",
        "name: t, type: Tween, body: base, mode: trigger, trigger_topic: go",
        "name: a, type: Aaa",
        "name: off, type: Off, enabled: false",
        "name: b, type: Bbb",
    )
    message = error_of(empty_world.spawn_model, path, "m")
    assert [line.split(":")[0] for line in message.split("\n")[1:2]] == [
        'Model Plugin "b" type "Bbb" model "m"'
    ]
    assert '"a" type "Aaa" model "m"' in message
    assert "Off" not in message
    assert f"[{path}:4]" in message
    assert f"[{path}:6]" in message
    assert (empty_world.models, empty_world.ports.commands) == ([], {})


def test_the_other_plugins_of_a_checked_model_are_checked_as_well(files, capsys):
    path = write_model(
        files, "m.yaml", "name: a, type: Aaa", "name: t, type: Tween, body: base, easing: fast"
    )
    assert main("check", path) == 1
    output = capsys.readouterr().out
    assert 'm.yaml:3: error: Model Plugin "a" type "Aaa"' in output
    assert "Easing fast does not exist" in output
    assert "m.yaml: 2 errors" in output


def test_one_missing_plugin_is_reported_in_one_line_with_correct_advice(
    files, empty_world, checkout
):
    path = write_model(files, "m.yaml", "name: p, type: Pump")
    message = error_of(empty_world.spawn_model, path, "m")
    assert message.startswith(
        'Flatland plugin: Model Plugin "p" type "Pump" model "m": no plugin '
        '"flatland_plugins::Pump"; C++ plugins cannot be loaded, '
    )
    assert message.endswith(f" [{path}:3]")
    assert "\n" not in message
    assert '"enabled: false"' in message
    path = write_model(files, "m.yaml", "name: p, type: Pump, enabled: false")
    assert empty_world.spawn_model(path, "m").plugins == []
    section, page = re.fullmatch('section "(.*)" of (.*)', PORTING_GUIDE).groups()
    assert f"\n## {section}\n" in (checkout / page).read_text()


@pytest.mark.parametrize(
    ("type_name", "similar"),
    [
        ("Lasser", '"Laser"'),
        ("laser", '"Laser"'),
        ("my_plugins::Laser", '"Laser"'),
        ("flatland_plugins/DiffDrive", '"DiffDrive"'),
        ("diff_drive", '"DiffDrive"'),
        ("ModelTFPublisher", '"ModelTfPublisher" or "PosePublisher"'),
        ("Pump", ""),
        ("PedestrianCrowd", '"Pedestrians"'),
        ("DummyModelPlugn", ""),
        ("DummyWorldPlugins", ""),
        ("Plugin", ""),
    ],
)
def test_similar_names_are_suggested(type_name, similar):
    message = find_error(type_name)
    found = re.search(r" \(did you mean (.*)\?\)", message)
    assert (found[1] if found else "") == similar
    assert "::Dummy" not in message.split("known plugins: ")[1]


def test_similar_names_of_other_packages_are_suggested(files, monkeypatch):
    classes = [
        f'<class name="{name}" type="a.B" base_class_type="flatland::ModelPlugin"/>'
        for name in ("robots::Battery", "carts::Battery", "robots::Wing")
    ]
    manifest = files.write("m.xml", f"<library>{''.join(classes)}</library>")
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", manifest)
    message = find_error("Batery")
    assert '(did you mean "carts::Battery" or "robots::Battery"?)' in message
    assert "known plugins: carts::Battery, robots::Battery, " in message


@pytest.mark.parametrize("tag", ["flatland", "flatland_server"])
def test_packages_that_export_a_cpp_plugin_of_the_same_name_are_named(
    files, monkeypatch, tag, caplog
):
    for name in ("hall", "other"):
        files.write(f"{name}/package.xml", CPP_PACKAGE.format(name=name, tag=tag))
        files.write(f"{name}/plugins.xml", CPP_MANIFEST)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(files.folder))
    places = [f'package "{name}" ({files.folder}/{name}/plugins.xml)' for name in ("hall", "other")]
    exported = f"; a C++ plugin of that name is exported by {places[0]} and {places[1]}; "
    for type_name in ("Elevator", "flatland_plugins::Elevator", "hall::Door"):
        assert exported in find_error(type_name)
    for type_name in ("Door", "hall_internal::Door", "x::Elevator"):
        assert "exported" not in find_error(type_name)
    assert "with errors" not in find_error("Door")
    assert not caplog.records
    path = f"{files.folder}/hall/plugins.xml"
    (files.folder / "hall" / "plugins.xml").unlink()
    message = find_error("Door")
    assert f'; manifests with errors: manifest "{path}" cannot be read: No such file' in message
    manifest = files.write("cpp.xml", CPP_MANIFEST)
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", manifest)
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    listed = f'a C++ plugin of that name is exported by manifest "{manifest}";'
    assert listed in find_error("Elevator")


def test_a_cpp_class_with_a_base_class_of_flatland_is_reported(files, monkeypatch):
    text = CPP_MANIFEST.replace("flatland_server::", "flatland::")
    manifest = files.write("cpp.xml", text)
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", manifest)
    assert (
        f'; manifests with errors: manifest "{manifest}", class "flatland_plugins::Elevator": '
        '"flatland_plugins::Elevator" is a C++ plugin, which cannot be loaded; '
        f"{PORTING_GUIDE} explains how to port it to Python"
    ) in find_error("Elevator")


@pytest.mark.parametrize(
    ("type_name", "advice"),
    [
        ("PedsimMovement", "a Python plugin can receive its agents with self.ros.subscribe"),
        ("VehicleMovement", "a Python plugin can receive its agents with self.ros.subscribe"),
        ("PosePub", "use PosePublisher, which publishes the true pose of a body"),
        ("DiffDrive2", "use DiffDrive"),
        ("SingleTrackDrive", "use AckermannDrive"),
        ("arena_plugins/RandomMove", "use PathFollower with mode: random"),
        ("Tween2", "or PathFollower for several waypoints"),
        ("HoloSecondOrder", "use OmniDrive"),
    ],
)
def test_alternatives_to_the_plugins_of_forks(type_name, advice):
    text = find_error(type_name).split("; forks of the reference have a plugin of that name: ")[1]
    assert advice in text


WHEELS = ("front_wheel_joint", "rear_left_wheel_joint", "rear_right_wheel_joint")


@pytest.mark.parametrize(
    ("type_name", "keys", "advice"),
    [
        ("SingleTrackDrive", ("body", *WHEELS, "odom_pub"), "use TricycleDrive"),
        ("SingleTrackDrive", ("body", "max_steer_angle", "wheelbase"), "use AckermannDrive"),
        ("SingleTrackDrive", ("body",), "use AckermannDrive; it also requires max_steer_angle"),
        (
            "SingleTrackDrive",
            ("body", *WHEELS, "target_twist_sub", "max_steering_angle"),
            "no included plugin for its purpose has the parameters "
            '"max_steering_angle", "target_twist_sub"',
        ),
        ("DiffDrive2", ("name", "type", "body", "twist_sub"), "use DiffDrive"),
        (
            "RandomMove",
            ("body", "linear_velocity"),
            'no included plugin for its purpose has the parameters "linear_velocity"',
        ),
    ],
)
def test_a_plugin_is_offered_only_if_it_has_the_parameters(type_name, keys, advice):
    assert alternative_to(type_name, keys) == advice


EXAMPLES = {
    "AckermannDrive": "body: b, max_steer_angle: 0.5, wheelbase: 1",
    "TricycleDrive": "body: b, front_wheel_joint: f, rear_left_wheel_joint: l, "
    "rear_right_wheel_joint: r",
    "DiffDrive": "body: b",
    "OmniDrive": "body: b",
    "PathFollower": "body: b, waypoints: [[1, 0]]",
    "PosePublisher": "body: b",
    "Tween": "body: b, delta: [1, 0, 0]",
}


@pytest.mark.parametrize("plugin", PARAMETERS)
def test_the_table_of_parameters_is_that_of_the_plugins(plugin, files):
    """Parameters that depend on others are not read here, and must be in the table only."""
    joints = "".join(
        f"- {{type: {kind}, name: {name}, bodies: [{{name: b, anchor: {anchor}}}, "
        f"{{name: w, anchor: [0, 0]}}]}}\n"
        for kind, name, anchor in (
            ("revolute", "f", "[0, 0]"), ("weld", "l", "[-1, 1]"), ("weld", "r", "[-1, -1]")
        )
    )  # fmt: skip
    path = files.write(
        "m.yaml",
        "bodies: [{name: b, footprints: []}, {name: w, footprints: []}]\n"
        f"joints:\n{joints}"
        f"plugins: [{{type: {plugin}, name: p, {EXAMPLES[plugin]}, unknown_key: 1}}]\n",
    )
    with flatland.World(seed=1) as world, pytest.raises(flatland.PluginError) as caught:
        world.spawn_model(path, "m")
    read = caught.value.__cause__.hint.removeprefix("other keys that are known here: ").split(", ")
    given = re.findall(r"(\w+):", EXAMPLES[plugin])
    assert set(read) <= PARAMETERS[plugin]
    assert set(given) <= PARAMETERS[plugin]
    assert REQUIRED[plugin] <= set(given)


def test_other_names_have_no_alternative():
    for type_name in ("Elevator", "Pose", "hall::Pub"):
        assert "fork" not in find_error(type_name)


def test_alternatives_name_existing_plugins_only():
    known = {name.split("::")[1] for name in flatland.World(seed=1).plugin_host.registry.classes}
    for name, text in ALTERNATIVES.items():
        assert name not in known
        words = re.findall(r"\b[A-Z][A-Za-z]{3,}\b", text)
        assert set(words) - {"Python"} <= known, name
