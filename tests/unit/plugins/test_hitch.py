"""Hitch: connecting, towing, releasing, and what ends a connection."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from racing_commands import RacingCommand

import flatland
from flatland.recording import Replay

BODIES = """
- name: base
  footprints: [{type: circle, radius: 0.3, density: 100}]
"""
TRAILER = """
bodies:
  - name: base
    footprints:
      - {type: circle, radius: 0.3, density: 50}
      - {type: polygon, density: 1, points: [[0.2, -0.05], [0.8, -0.05], [0.8, 0.05], [0.2, 0.05]]}
"""


def plugins(text: str = "") -> str:
    return (
        "[{type: DiffDrive, name: drive, body: base}, "
        f"{{type: Hitch, name: hitch, body: base, origin: [-0.35, 0], {text}}}]"
    )


@pytest.fixture
def tow(plugin_world: Any) -> Any:
    def load(text: str = "", x: float = -1.2, **options: Any) -> flatland.World:
        world: flatland.World = plugin_world(plugins(text), **{"bodies": BODIES, **options})
        world.spawn_model("\n" + TRAILER, "trailer", pose=(x, 0.0, 0.0))
        return world

    return load


def hitch(world: flatland.World) -> Any:
    return world.model("robot").plugin("hitch")


def anchors(world: flatland.World) -> float:
    """Returns the distance between the hook and the place on the trailer where it was connected."""
    x, y, theta = world.model("robot").pose
    hook = (x - 0.35 * math.cos(theta), y - 0.35 * math.sin(theta))
    x, y, theta = world.model("trailer").pose
    eye = (x + 0.85 * math.cos(theta), y + 0.85 * math.sin(theta))
    return math.dist(hook, eye)


class TestTowing:
    @pytest.mark.parametrize("last", [False, True])
    def test_a_command_that_arrives_while_another_one_is_carried_out(
        self, tow: Any, last: bool
    ) -> None:
        world = tow()
        plugin, command = hitch(world), world.ports.commands["/hitch"][0]
        command.set(last)
        world.step()
        command.set(not last)
        plugin._command = RacingCommand(command, last)
        world.step(3)
        assert (plugin.hitched is not None) == last

    @pytest.mark.parametrize("joint", ["hinge", "weld"])
    def test_trailer_follows(self, tow: Any, joint: str) -> None:
        """In a turn, a hinge bends and a weld keeps the angle."""
        world = tow(f"joint: {joint}, update_rate: .inf")
        state = world.output("/hitched")
        world.step()
        assert state.latest is False
        world.command("/hitch").set(True)
        world.command("/cmd_vel").set(flatland.Twist(0.5))
        world.step(400)
        assert state.latest is True
        assert hitch(world).hitched is world.model("trailer")
        assert world.model("robot").pose[0] == pytest.approx(1.0, abs=0.01)
        assert world.model("trailer").pose == pytest.approx((-0.2, 0.0, 0.0), abs=0.01)
        world.command("/cmd_vel").set(flatland.Twist(0.3, 0.0, 0.6))
        world.step(200)
        angles = [world.model(name).pose[2] for name in ("robot", "trailer")]
        bent = abs(angles[0] - angles[1])
        assert bent < 0.02 if joint == "weld" else bent > 0.2
        assert anchors(world) < 0.01

    def test_limit_of_the_angle(self, tow: Any) -> None:
        world = tow("max_angle: 0.1, collide: true")
        world.command("/hitch").set(True)
        world.command("/cmd_vel").set(flatland.Twist(0.1, 0.0, 0.6))
        world.step(400)
        angles = [world.model(name).pose[2] for name in ("robot", "trailer")]
        assert abs(angles[0] - angles[1]) < 0.13

    def test_released_trailer_stays_behind(self, tow: Any) -> None:
        world = tow()
        world.command("/hitch").set(True)
        world.step()
        world.command("/hitch").set(False)
        world.step()
        assert hitch(world).hitched is None
        world.model("trailer").bodies[0].set_velocity(0, 0, 0)
        world.command("/cmd_vel").set(flatland.Twist(0.5))
        world.step(200)
        assert world.model("trailer").pose[0] == pytest.approx(-1.2, abs=1e-3)


class TestChoice:
    def test_nothing_within_reach_is_a_warning(
        self, tow: Any, caplog: pytest.LogCaptureFixture
    ) -> None:
        world = tow("reach: 0.1", x=-1.3)
        with caplog.at_level(logging.WARNING):
            for _ in range(3):  # a joystick repeats commands
                world.command("/hitch").set(True)
                world.step(10)
        messages = [r.getMessage() for r in caplog.records]
        assert messages == [
            'Flatland World: plugin "hitch" of model "robot": no model is within 0.1 m'
        ]
        assert hitch(world).hitched is None
        with pytest.raises(flatland.WorldError, match='model "trailer" is not within'):
            hitch(world).attach("trailer")

    def test_reach_is_measured_to_the_shape(self, tow: Any) -> None:
        # The drawbar ends at x = -0.49, 0.14 m from the hook.
        assert hitch(tow("reach: 0.15", x=-1.29)).attach() is not None
        with pytest.raises(flatland.WorldError, match="within"):
            hitch(tow("reach: 0.13", x=-1.29)).attach()

    def test_nearest_model_in_any_order(self, tow: Any) -> None:
        world = tow("reach: 1", x=-1.25)
        world.spawn_model("\n" + TRAILER, "far", pose=(-0.7, 1.2, 0.0))
        assert hitch(world).attach().name == "trailer"
        with pytest.raises(flatland.WorldError, match='already connected to "trailer"'):
            hitch(world).attach("far")
        hitch(world).detach()
        assert hitch(world).attach("far").name == "far"
        hitch(world).detach()
        world.spawn_model("\n" + TRAILER, "near", pose=(-0.35, -0.83, math.pi / 2))
        assert hitch(world).attach().name == "near"

    def test_models_restricts_the_choice(self, tow: Any) -> None:
        world = tow("models: [dock]")
        with pytest.raises(flatland.WorldError, match="no model is within"):
            hitch(world).attach()

    def test_two_bodies_that_no_force_moves_are_not_connected(self, plugin_world: Any) -> None:
        fixed = BODIES.replace("- name: base", "- name: base\n  type: static")
        world = plugin_world("[{type: Hitch, name: hitch, body: base, reach: 1}]", bodies=fixed)
        fixed_trailer = TRAILER.replace("- name: base", "- name: base\n    type: static")
        world.spawn_model("\n" + fixed_trailer, "trailer", pose=(-0.7, 0.0, 0.0))
        with pytest.raises(flatland.WorldError, match="no model is within"):
            hitch(world).attach()
        world.spawn_model("\n" + TRAILER, "loose", pose=(0.7, 0.0, 0.0))
        assert hitch(world).attach().name == "loose"

    def test_angle_beyond_the_limit(self, tow: Any) -> None:
        world = tow("max_angle: 0.2, reach: 0.5")
        world.move_model("trailer", (-0.8, -0.8, 1.2))
        with pytest.raises(flatland.WorldError, match=r"beyond the limit of 0\.200"):
            hitch(world).attach()
        assert world.physics.object_counts().joints == 0

    def test_the_service_names_what_it_connected_or_released(self, tow: Any) -> None:
        pytest.importorskip("std_srvs.srv", reason="ROS is not installed")
        services: dict[str, Callable[[Any], Any]] = {}

        class Bridge(flatland.WorldObserver):
            def plugin_ros(self, plugin: Any) -> Any:
                def advertise(name: str, _kind: object, serve: Callable[[Any], Any]) -> None:
                    services[name] = serve

                return SimpleNamespace(advertise_service=advertise, close=lambda: None)

        world = tow(observers=[Bridge()])

        def call(hitched: bool) -> tuple[bool, str]:
            response = services["set_hitch"](SimpleNamespace(data=hitched))
            return response.success, response.message

        assert call(True) == (True, "hitched: trailer")
        assert hitch(world).hitched is world.model("trailer")
        assert call(False) == (True, "released: trailer")
        assert call(False) == (True, "released: nothing")
        world.delete_model("trailer")
        is_done, text = call(True)
        assert not is_done
        assert "no model is within 0.1 m" in text

    def test_a_call_replaces_an_earlier_command(self, tow: Any) -> None:
        world = tow()
        world.command("/hitch").set(False)
        hitch(world).attach("trailer")
        world.step()
        assert hitch(world).hitched is world.model("trailer")
        world.command("/hitch").set(True)
        hitch(world).detach()
        world.step()
        assert hitch(world).hitched is None


class TestEnds:
    def test_deleted_trailer(self, tow: Any) -> None:
        world = tow()
        hitch(world).attach()
        world.delete_model("trailer")
        world.step(10)
        assert hitch(world).hitched is None
        world.spawn_model("\n" + TRAILER, "trailer", pose=(-1.2, 0.0, 0.0))
        assert hitch(world).attach().name == "trailer"

    @pytest.mark.parametrize(
        "end", [lambda world: world.delete_model("robot"), flatland.World.reset]
    )
    def test_deleted_tractor_and_reset(self, tow: Any, end: Any) -> None:
        world = tow()
        trailer = world.model("trailer")
        hitch(world).attach()
        end(world)
        world.step(10)
        assert world.physics.object_counts().joints == 0
        assert trailer.followers == []
        assert all(hitch(world).hitched is None for model in world.models if model.name == "robot")

    @pytest.mark.parametrize("moved", ["robot", "trailer"])
    def test_a_move_of_either_model_releases(self, tow: Any, moved: str) -> None:
        world = tow()
        hitch(world).attach()
        world.move_model(moved, (5.0, 5.0, 0.0))
        assert hitch(world).hitched is None
        poses = {name: world.model(name).pose for name in ("robot", "trailer")}
        world.step(100)
        for name, pose in poses.items():
            assert world.model(name).pose == pytest.approx(pose, abs=1e-6)

    def test_snapshot_and_clone(self, tow: Any) -> None:
        world = tow()
        world.command("/cmd_vel").set(flatland.Twist(0.5, 0.0, 0.3))
        loose = world.snapshot()
        hitch(world).attach()
        world.step(50)
        hitched = world.snapshot()
        with world.clone() as copy:
            for each in (world, copy):
                each.step(100)
            assert copy.state_hash() == world.state_hash()
            assert hitch(copy).hitched is copy.model("trailer")
            copy.delete_model("trailer")
            assert hitch(world).hitched is world.model("trailer")
        end = world.state_hash()
        hitch(world).detach()
        world.restore(hitched)
        assert hitch(world).hitched is world.model("trailer")
        world.step(100)
        assert world.state_hash() == end
        world.restore(loose)
        assert hitch(world).hitched is None
        assert world.physics.object_counts().joints == 0
        assert world.model("trailer").followers == []

    def test_recordings_contain_connections_that_end_before_the_next_step(
        self, plugin_world: Any, tmp_path: Path
    ) -> None:
        path = tmp_path / "run.flog"
        with plugin_world(plugins("start: true"), bodies=BODIES) as world:
            world.record(path)
            world.spawn_model("\n" + TRAILER, "trailer", pose=(-1.2, 0.0, 0.0))
            hitch(world).detach()  # instead of the connection at the start
            world.step()
            assert hitch(world).hitched is None
            hitch(world).attach()
            world.move_model("robot", (2.0, 0.0, 0.0))
            world.command("/cmd_vel").set(flatland.Twist(0.5))
            world.step(20)
            with pytest.raises(flatland.WorldError, match="within"):
                hitch(world).attach("trailer")
            world.move_model("robot", (0.0, 0.0, 0.0))
            world.call_plugin("hitch", "connect", {"name": "trailer"}, "robot")
            world.step(20)
            assert hitch(world).hitched is world.model("trailer")
            for name, model in (("hitch", ""), ("hitch", "trailer"), ("drive", "robot")):
                with pytest.raises(flatland.WorldError, match="does not exist"):
                    world.call_plugin(name, "connect", {}, model)
        replay = Replay(path)
        replay.run()
        replay.close()
        assert (replay.difference, replay.last_step) == (None, 41)
