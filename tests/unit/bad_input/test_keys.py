"""Every key of every file: missing, misspelled, empty, of a wrong type or out of range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import tricycle
from broken_yaml import Case, Key, Section, cases

import flatland

MAP = "image: map.png\nresolution: 0.1\norigin: [0, 0, 0]\noccupied_thresh: 0.5\n"
CIRCLE = "[{type: circle, radius: 0.2, density: 1}]"
BODIES = f"bodies: [{{name: base, footprints: {CIRCLE}}}, {{name: wheel, footprints: []}}]\n"
ENDS = "[{name: base, anchor: [0, 0]}, {name: wheel, anchor: [0, 0]}]"
MODEL = 'model "robot"'


def keys(kind: str, limit: str = "", required: bool = False, **values: str) -> tuple[Key, ...]:
    """Returns keys of one kind with their valid values."""
    return tuple(Key(name, value, kind, required, limit) for name, value in values.items())


ENABLED = Key("enabled", "true", "bool")
MATERIAL_KEYS = tuple(
    Key(name, "0.5", "float", limit="0 to 1")
    for name in ("reflectance", "transmission", "specular")
)
WORLD_SECTIONS = [
    Section(
        "world",
        "",
        (
            Key("properties", "{}", "map", required=True),
            Key("layers", "[]", "list", required=True),
            *keys("list", models="[]", plugins="[]"),
        ),
    ),
    Section(
        "properties",
        "layers: [{name: 2d}]\nproperties:\n",
        (
            *keys("int", "1 to 1000", velocity_iterations="10", position_iterations="10"),
            Key("publish_map", "2d"),
        ),
        indent=2,
        location='"properties"',
        label='"properties"',
    ),
    Section(
        "layer",
        "properties: {}\nlayers:\n",
        (
            Key("name", "2d", "string or strings", required=True),
            Key("map", "map.yaml"),
            Key("color", "[1, 1, 1, 1]", "color", limit="finite"),
            Key("class", "wall"),
            *keys("map", material="{}", properties="{}"),
        ),
        indent=4,
        is_item=True,
        location='"layers" index=0',
        label="index=0",
        label_location='"layers"',
    ),
    Section(
        "layer material",
        "properties: {}\nlayers:\n  - name: 2d\n    material:\n",
        MATERIAL_KEYS,
        indent=6,
        location='"layers" index=0 "material"',
        label='"material"',
        label_location='"layers" index=0',
    ),
    Section(
        "model entry",
        "properties: {}\nlayers: []\nmodels:\n",
        (
            Key("name", "robot", required=True, location='"models" index=0'),
            Key("model", "good.model.yaml", required=True),
            Key("pose", "[0, 0, 0]", "pose", limit="finite"),
            Key("namespace", "r1"),
        ),
        indent=4,
        is_item=True,
        location=MODEL,
        label_location=MODEL,
    ),
    Section(
        "RandomWall",
        "properties: {}\nlayers: [{name: 2d, map: map.yaml}]\n"
        "models: [{name: robot, model: good.model.yaml}]\nplugins:\n  - type: RandomWall\n"
        "    name: walls\n",
        (
            *keys("string", required=True, layer="2d", robot_name="robot"),
            Key("num_of_walls", "1", "int"),
            Key("wall_wall_dist", "1", "float", limit="finite"),
            Key("double_wall", "false", "bool"),
        ),
        lead=2,
        indent=4,
        location='world_plugin "walls"',
        label='world_plugin "walls"',
        prefix='Flatland plugin: World Plugin "walls" type "RandomWall": Flatland YAML: ',
        error_class="PluginError",
    ),
]
MAP_SECTIONS = [
    Section(
        "image map",
        "",
        (
            Key("image", "map.png", required=True),
            *keys("float", "finite", required=True, resolution="0.1", occupied_thresh="0.5"),
            Key("origin", "[0, 0, 0]", "pose", required=True, limit="finite"),
        ),
        location='layer "2d"',
        unknown_keys=False,
    ),
    Section(
        "line map",
        "type: line_segments\n",
        (
            Key("data", "walls.dat", required=True),
            Key("scale", "1", "float", required=True, limit="finite"),
            Key("origin", "[0, 0, 0]", "pose", required=True, limit="finite"),
        ),
        lead=1,
        location='layer "2d"',
        unknown_keys=False,
    ),
]
COLOR = Key("color", "[1, 1, 1, 0.5]", "color", limit="finite")
FOOTPRINT_KEYS = (
    Key("density", "1", "float", required=True, limit="finite, >= 0"),
    *keys("float", "finite, >= 0", friction="0", restitution="0"),
    *keys("bool", sensor="false", collision="true"),
    Key("layers", "[2d]", "names"),
    Key("material", "{}", "map"),
)
FOOTPRINT: dict[str, Any] = {
    "before": "bodies:\n  - name: base\n    footprints:\n",
    "indent": 8,
    "is_item": True,
    "location": f'{MODEL} body "base" "footprints" index=0',
    "label": "index=0",
    "label_location": f'{MODEL} body "base" "footprints"',
}
JOINT_KEYS = (
    Key("name", "j", required=True, location=f'{MODEL} "joints" index=0'),
    Key("bodies", ENDS, "list", required=True),
    COLOR,
    Key("collide_connected", "false", "bool"),
    ENABLED,
)
JOINT: dict[str, Any] = {
    "before": BODIES + "joints:\n",
    "indent": 4,
    "is_item": True,
    "location": f'{MODEL} joint "j"',
    "label": 'joint "j"',
    "label_location": MODEL,
}
BODY_SECTIONS = [
    Section(
        "model",
        "",
        (
            Key("bodies", f"[{{name: base, footprints: {CIRCLE}}}]", "list", required=True),
            *keys("list", joints="[]", plugins="[]"),
            Key("class", "chair"),
        ),
        location=MODEL,
        label_location=MODEL,
    ),
    Section(
        "body",
        "bodies:\n",
        (
            Key("name", "base", required=True, location=f'{MODEL} "bodies" index=0'),
            Key("footprints", CIRCLE, "list", required=True),
            Key("pose", "[0, 0, 0]", "pose", limit="finite"),
            Key("type", "dynamic"),
            COLOR,
            *keys("float", "finite, >= 0", linear_damping="0", angular_damping="0"),
            Key("class", "chair"),
            ENABLED,
        ),
        indent=4,
        is_item=True,
        location=f'{MODEL} body "base"',
        label='body "base"',
        label_location=MODEL,
    ),
    Section(
        "circle",
        keys=(
            Key("type", "circle", required=True),
            Key("radius", "0.2", "float", required=True, limit="finite, >= 0"),
            Key("center", "[0, 0]", "vector", limit="finite"),
            *FOOTPRINT_KEYS,
        ),
        **FOOTPRINT,
    ),
    Section(
        "polygon",
        keys=(
            Key("type", "polygon", required=True),
            Key("points", "[[0, 0], [1, 0], [0, 1]]", "list", required=True),
            *FOOTPRINT_KEYS,
        ),
        **FOOTPRINT,
    ),
    Section(
        "revolute",
        keys=(
            *JOINT_KEYS,
            Key("type", "revolute", required=True),
            Key("limits", "[-1, 1]", "2 floats", limit="finite"),
        ),
        **JOINT,
    ),
    Section(
        "weld",
        keys=(
            *JOINT_KEYS,
            Key("type", "weld", required=True),
            Key("angle", "0", "float", limit="finite"),
            *keys("float", "finite, >= 0", frequency="0", damping="0"),
        ),
        **JOINT,
    ),
    Section(
        "joint end",
        BODIES + "joints:\n  - name: j\n    type: weld\n    bodies:\n"
        "      - {name: wheel, anchor: [0, 0]}\n",
        (
            Key("name", "base", required=True),
            Key("anchor", "[0, 0]", "2 floats", required=True, limit="finite"),
        ),
        indent=8,
        is_item=True,
        location=f'{MODEL} joint "j" "bodies" index=1',
        unknown_keys=False,
    ),
    Section(
        "plugin entry",
        BODIES + "plugins:\n  - body: base\n",
        keys("string", required=True, name="p", type="Tween"),
        lead=1,
        indent=4,
        location=f'{MODEL} "plugins" index=0',
        unknown_keys=False,
    ),
]

RATE = Key("update_rate", "10", "float", limit=">= 0")
AFTER_STEP = Key("after_step", "false", "bool")
BODY = Key("body", "base", required=True)
ORIGIN = Key("origin", "[0, 0, 0]", "pose", limit="coordinate")
ANGLE = Key("angle", "{min: 0, max: 1, increment: 0.5}", "map", required=True)
RANGE = Key("range", "5", "float", required=True)
RANGE_SENSOR = (
    ORIGIN,
    RATE,
    Key("broadcast_tf", "true", "bool"),
    Key("noise_std_dev", "0", "float", limit=">= 0"),
    Key("out_of_range", "drop", "string"),
    Key("layers", "[2d]", "names"),
    AFTER_STEP,
)
THREE_WHEELS = f"bodies:{tricycle.BODIES}joints:\n{tricycle.JOINTS}"
DRIVE_KEYS = (
    BODY,
    *keys(
        "string",
        twist_sub="cmd_vel",
        odom_pub="odom",
        ground_truth_pub="truth",
        odom_frame_id="odom",
        ground_truth_frame_id="map",
    ),
    Key("pub_rate", "10", "float", limit=">= 0"),
    *keys("bool", enable_odom_tf_pub="true", twist_in_local_frame="true"),
    *keys("3 floats", "finite, >= 0", odom_pose_noise="[0, 0, 0]", odom_twist_noise="[0, 0, 0]"),
    Key("odom_drift", "[0, 0, 0, 0]", "4 floats", limit="finite, >= 0"),
    Key("odom_pose_covariance", f"[{', '.join('0' * 36)}]", "36 floats"),
    Key("odom_twist_covariance", f"[{', '.join('0' * 36)}]", "36 floats"),
    *keys("map", linear_dynamics="{}", angular_dynamics="{}"),
    Key("command_timeout", "1", "float", limit=">= 0"),
    AFTER_STEP,
)


def plugin(
    type_name: str, *keys: Key, bodies: str = BODIES, more: str = "", inner: str = ""
) -> Section:
    """Returns the section of a plugin `p`, or of a map in it."""
    start = f"{bodies}plugins:\n  - type: {type_name}\n    name: p\n{more}"
    owner = f'{MODEL} plugin "p"'
    return Section(
        f"{type_name} {inner}".strip(),
        start + (f"    {inner}:\n" if inner else ""),
        keys,
        lead=0 if inner else 2 + more.count("\n"),
        indent=6 if inner else 4,
        location=f'{owner} "{inner}"' if inner else owner,
        label=f'"{inner}"' if inner else 'plugin "p"',
        label_location=owner if inner else MODEL,
        prefix=f'Flatland plugin: Model Plugin "p" type "{type_name}" {MODEL}: Flatland YAML: ',
        error_class="PluginError",
    )


LIMITS = tuple(
    Key(f"{name}_limit", "1", "float", limit=">= 0")
    for name in ("velocity", "acceleration", "deceleration")
)
FORCE_KEYS = (
    Key("mode", "force", is_independent=False),
    *keys("float", ">= 0", required=True, max_force="1", max_torque="1"),
    Key("friction", "1", "float", limit=">= 0"),
    Key("grip_radius", "1", "float", limit="finite, >= 0"),
)
PLUGIN_SECTIONS = [
    plugin(
        "Laser",
        BODY,
        RANGE,
        ANGLE,
        *keys("string", topic="scan", frame="laser", no_hit="nan"),
        *keys("bool", always_publish="false", upside_down="false"),
        Key("scan_time", "0", "float", limit="finite, >= 0"),
        *RANGE_SENSOR,
    ),
    plugin(
        "Laser",
        *keys("float", required=True, min="0", max="1", increment="0.5"),
        more="    body: base\n    range: 5\n",
        inner="angle",
    ),
    plugin(
        "Laser",
        BODY,
        Key("noise_model", "beam", is_independent=False),
        Key("z_hit", "0.7", "float", limit="0 to 1"),
        Key("z_rand", "0.3", "float", limit="0 to 1", is_independent=False),
        more="    range: 5\n    angle: {min: 0, max: 1, increment: 0.5}\n",
    ),
    plugin(
        "DiffDrive",
        *DRIVE_KEYS,
        Key("twist_pub", "twist"),
        *keys("bool", enable_odom_pub="true", enable_twist_pub="true"),
    ),
    plugin("DiffDrive", *FORCE_KEYS, more="    body: base\n"),
    plugin("DiffDrive", *LIMITS, more="    body: base\n", inner="linear_dynamics"),
    plugin("DiffDrive", *LIMITS, more="    body: base\n", inner="angular_dynamics"),
    plugin(
        "TricycleDrive",
        BODY,
        *keys(
            "string",
            required=True,
            front_wheel_joint="front_j",
            rear_left_wheel_joint="left_j",
            rear_right_wheel_joint="right_j",
        ),
        *keys(
            "float",
            ">= 0",
            max_steer_angle="0",
            max_angular_velocity="0",
            max_steer_acceleration="0",
        ),
        bodies=THREE_WHEELS,
    ),
    plugin(
        "AckermannDrive",
        BODY,
        *keys("float", "finite", required=True, max_steer_angle="0.5", wheelbase="1"),
        Key("rear_axle", "[0, 0]", "vector", limit="coordinate"),
        *keys("string", command="steering", twist_pub="twist"),
    ),
    plugin(
        "OmniDrive",
        BODY,
        Key("layout", "mecanum", is_independent=False),
        *keys("float", "finite", required=True, wheelbase="1", track="1"),
        *keys("float", ">= 0", max_wheel_speed="0", max_wheel_acceleration="0"),
    ),
    plugin(
        "OmniDrive",
        BODY,
        Key("layout", "three_wheel", is_independent=False),
        Key("wheel_distance", "1", "float", required=True, limit="finite"),
        Key("wheel_angle", "1", "float", limit="finite"),
    ),
    plugin(
        "PathFollower",
        *keys(
            "string", body="base", frame="world", heading="forward", mode="once", start_topic="go"
        ),
        Key("waypoints", "[[1, 0]]", "list", required=True),
        *keys("float", "finite", speed="1", angular_speed="1"),
        *keys(
            "float",
            ">= 0",
            acceleration="1",
            deceleration="1",
            angular_acceleration="1",
            angular_deceleration="1",
        ),
        Key("wait", "1", "float", limit="finite, >= 0"),
        Key("start", "true", "bool"),
    ),
    plugin(
        "WheelStates",
        *keys("string", body="base", topic="joint_states"),
        Key("wheels", "[{name: left, radius: 0.1}]", "list", required=True),
        Key("ticks_per_turn", "0", "int"),
        RATE,
    ),
    replace(
        plugin(
            "WheelStates",
            Key("name", "left", required=True),
            Key("radius", "0.1", "float", required=True, limit="finite, >= 1e-06"),
            Key("body", "base"),
            Key("position", "[0, 0]", "vector", limit="coordinate"),
            *keys("float", "finite", heading="0", roller_angle="1"),
            inner="wheels",
        ),
        is_item=True,
        indent=8,
        location=f'{MODEL} plugin "p" "wheels" index=0',
        label="index=0",
        label_location=f'{MODEL} plugin "p" "wheels"',
    ),
    plugin(
        "Hitch",
        *keys(
            "string", body="base", joint="hinge", topic="hitch", state_topic="hitched", service='""'
        ),
        Key("origin", "[0, 0]", "vector", limit="coordinate"),
        Key("reach", "0.1", "float", limit="0 to 1e8"),
        Key("max_angle", "1", "float"),
        Key("models", "[]", "names"),
        *keys("bool", collide="false", start="false"),
        RATE,
    ),
    plugin(
        "ModelTfPublisher",
        *keys("string", reference="base", world_frame_id="map"),
        Key("publish_tf_world", "false", "bool"),
        Key("exclude", "[]", "names"),
        RATE,
        AFTER_STEP,
    ),
    plugin(
        "Sonar",
        BODY,
        RANGE,
        Key("field_of_view", "0.5", "float", required=True),
        *keys("string", radiation_type="infrared", topic="range", frame="sonar", no_hit="inf"),
        Key("smallest_object", "0.1", "float"),
        *RANGE_SENSOR,
    ),
    plugin(
        "SemanticScan",
        BODY,
        RANGE,
        ANGLE,
        *keys("string", topic="labels", frame="laser", no_hit="nan"),
        Key("classes", "{}", "map"),
        *RANGE_SENSOR,
    ),
    plugin(
        "PosePublisher",
        *keys("string", body="base", message="odometry", topic="pose", frame_id="map"),
        ORIGIN,
        RATE,
        Key("after_step", "false", "bool"),
    ),
    plugin(
        "Bumper",
        *keys("string", topic="collisions", world_frame_id="map"),
        RATE,
        Key("publish_all_collisions", "true", "bool"),
        Key("exclude", "[]", "names"),
    ),
    plugin("BoolSensor", *keys("string", topic="touch", body="base"), RATE),
    plugin(
        "Gps",
        BODY,
        *keys("string", topic="gps", frame="gps"),
        ORIGIN,
        Key("broadcast_tf", "true", "bool"),
        RATE,
        *keys("float", "finite", ref_lat="0", ref_lon="0"),
    ),
    plugin(
        "Imu",
        BODY,
        *keys("string", imu_pub="imu", ground_truth_pub="truth", imu_frame_id="imu"),
        *keys("bool", enable_imu_pub="true", broadcast_tf="true"),
        RATE,
        *(
            Key(f"{name}_noise", "[0, 0, 0]", "3 floats", limit="finite, >= 0")
            for name in ("orientation", "angular_velocity", "linear_acceleration")
        ),
        *(
            Key(f"{name}_covariance", f"[{', '.join('0' * 9)}]", "9 floats")
            for name in ("orientation", "angular_velocity", "linear_acceleration")
        ),
    ),
    plugin(
        "Tween",
        BODY,
        Key("delta", "[0, 0, 0]", "pose", limit="coordinate"),
        Key("duration", "1", "float", limit="finite"),
        *keys("string", mode="yoyo", easing="linear", trigger_topic='""'),
    ),
    plugin(
        "DummyModelPlugin",
        Key("dummy_param_float", "0.123456", "float", required=True),
        Key("dummy_param_string", "dummy_test_123456", required=True),
        Key("dummy_param_int", "123456", "int", required=True),
    ),
]
MODEL_SECTIONS = BODY_SECTIONS + PLUGIN_SECTIONS


def check(error: flatland.FlatlandError, case: Case, path: Path) -> None:
    """Compares an error with the expected one."""
    assert type(error).__name__ == case.error_class
    assert str(error) == f"{case.message} [{path}:{case.line}]", case.name
    assert error.place is not None
    assert (error.place.path, error.place.line) == (str(path), case.line)
    if case.hint is not None:
        assert error.hint == case.hint
        assert f"hint: {case.hint}" in error.__notes__


def each(sections: list[Section]) -> Any:
    """Parametrizes a test with some sections."""
    return pytest.mark.parametrize("section", sections, ids=lambda section: section.title)


def check_all(section: Section, path: Path, load: Callable[[], object]) -> None:
    """Loads the valid file of a section, and all files that are broken in one place.

    Args:
        section: The section.
        path: The file to write.
        load: Loads the file, and removes what was loaded.
    """
    path.write_text(section.text())
    load()
    for case in cases(section):
        path.write_text(case.text)
        try:
            load()
        except flatland.FlatlandError as error:
            check(error, case, path)
        else:
            pytest.fail(f"{case.name}: no error")


@each(WORLD_SECTIONS)
def test_a_world(folder: Path, unchanged: Any, section: Section) -> None:
    path = folder / "broken.yaml"
    with unchanged():
        check_all(section, path, lambda: flatland.World.from_yaml(path, seed=1).close())


@each(MAP_SECTIONS)
def test_a_map(folder: Path, unchanged: Any, section: Section) -> None:
    world = folder / "mapped.yaml"
    world.write_text("properties: {}\nlayers: [{name: 2d, map: broken_map.yaml}]\n")
    with unchanged():
        check_all(
            section,
            folder / "broken_map.yaml",
            lambda: flatland.World.from_yaml(world, seed=1).close(),
        )


@each(MODEL_SECTIONS)
def test_a_model(
    running_world: flatland.World, folder: Path, unchanged: Any, section: Section
) -> None:
    def load() -> None:
        running_world.spawn_model("broken.model.yaml", "robot", "robot", (9, 9, 0))
        running_world.delete_model("robot")

    with unchanged(running_world):
        check_all(section, folder / "broken.model.yaml", load)
