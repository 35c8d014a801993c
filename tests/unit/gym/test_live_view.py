"""The render mode `human`: environments in the browser."""

from __future__ import annotations

import os
import re
import socket
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from programs import run_program
from web_client import WebClient

import flatland.gym
from flatland.errors import FlatlandError
from flatland.gym import FlatlandEnv, FlatlandVectorEnv, live_view
from flatland.gym.fleet import FleetEnv

Make = Callable[..., Any]

AHEAD = np.array([1.0, 0.0], np.float32)


def printed_urls(capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Returns the addresses printed since the last call."""
    return re.findall(r"^flatland: (http://\S+)$", capsys.readouterr().err, re.MULTILINE)


def goal_edges(client: WebClient, world: int = 0) -> np.ndarray:
    """Returns the edges of the goals of a world, shape (n, 4)."""
    number = client.until(
        "goals",
        lambda: next(
            (n for n, layer in enumerate(layers(client, world)) if layer["name"] == "goals"), None
        ),
    )
    edges = client.until("edges", lambda: client.worlds[world]["edges"].get(number))
    return np.array(edges)


def layers(client: WebClient, world: int) -> list[dict[str, Any]]:
    return list(client.worlds.get(world, {}).get("world", {}).get("layers", []))


def test_the_page_shows_the_robot_and_its_goal(
    make: Make, room: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    env = make(FlatlandEnv, room, render_mode="human")
    env.reset(seed=0, options={"start": (1, 2, 0), "goal": (5, 3)})
    (url,) = printed_urls(capsys)
    with WebClient(url) as client:
        assert [world["name"] for world in client.hello["worlds"]] == [room.parent.name]
        assert client.pose("robot") == pytest.approx((1, 2, 0))
        edges = goal_edges(client)
        radius = env.unwrapped.episodes.goal_radius
        distances = np.hypot(*(edges[:, :2] - (5, 3)).T)
        assert distances == pytest.approx(np.full(len(edges), radius), abs=1e-5)
        env.step(AHEAD)
        x = env.world.model("robot").pose[0]
        assert x > 1
        client.until("motion", lambda: client.pose("robot")[0] == pytest.approx(x, abs=1e-5))
        env.reset(seed=0, options={"start": (1, 2, 0), "goal": (4, 1)})
        client.until(
            "the next goal",
            lambda: goal_edges(client)[:, :2].mean(0) == pytest.approx((4, 1), abs=1e-4),
        )
        assert env.render() is None
        # Only the agent acts.
        assert "read-only" in client.refused(
            "move", model=client.model("robot")["id"], pose=[0] * 3
        )


def test_environments_share_a_viewer_that_ends_with_the_last_of_them(
    make: Make, room: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = (make(FlatlandEnv, room, render_mode="human") for _ in range(2))
    assert printed_urls(capsys) == [], "nothing is shown before the first reset"
    first.reset(seed=0)
    second.reset(seed=1)
    (url,) = printed_urls(capsys)
    with WebClient(url) as client:
        assert [world["world"] for world in client.hello["worlds"]] == [0, 1]
        assert client.pose("robot", 0) != client.pose("robot", 1)
        first.close()
        first.close()
        client.until("the end of a world", lambda: 0 not in client.worlds)
        assert client.pose("robot", 1)
        second.close()
        with pytest.raises(ConnectionError):
            client.until("the end", lambda: False)
    # Another environment opens the viewer again.
    third = make(FlatlandEnv, room, render_mode="human")
    third.reset(seed=0)
    assert len(printed_urls(capsys)) == 1


def test_a_vector_of_environments_is_a_grid_of_worlds(
    make: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    envs = make(flatland.gym.make_vec, "flatland/Corridor-v0", num_envs=3, render_mode="human")
    envs.reset(seed=[1, 2, 3])
    (url,) = printed_urls(capsys)
    with WebClient(url) as client:
        names = [world["name"] for world in client.hello["worlds"]]
        assert names == ["corridor 0", "corridor 1", "corridor 2"]
        envs.step(np.tile(AHEAD, (3, 1)))
        for row, pose in enumerate(envs.poses):
            place = pytest.approx(pose[:2], abs=1e-5)
            client.until(
                "motion", lambda row=row, place=place: client.pose("robot", row)[:2] == place
            )
            center = goal_edges(client, row)[:, :2].mean(0)
            assert center == pytest.approx(envs.goals[row], abs=1e-3)


def test_all_goals_of_a_fleet_are_shown(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    env = make(FleetEnv, 3, render_mode="human")
    env.reset(seed=0)
    with WebClient(printed_urls(capsys)[0]) as client:
        circles = goal_edges(client).reshape(3, -1, 4)
        expected = list(env.goals.values())
        assert circles[:, :, :2].mean(1) == pytest.approx(np.array(expected), abs=1e-3)
        assert client.pose("robot_2") == pytest.approx(env.world.model("robot_2").pose, abs=1e-5)


def test_steps_take_their_simulated_time(
    make: Make, room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a clock that only advances while the environment waits."""
    now = 100.0
    waits: list[float] = []

    def sleep(seconds: float) -> None:
        nonlocal now
        waits.append(seconds)
        now += seconds

    env = make(FlatlandEnv, room, render_mode="human", physics_steps=10)
    # Only that of the module: other threads use the module `time`, too.
    clock = SimpleNamespace(monotonic=lambda: now, sleep=sleep)
    monkeypatch.setattr(live_view, "time", clock)
    env.reset(seed=0)
    env.step(AHEAD)
    now += 0.02  # of the program
    env.step(AHEAD)
    now += 60.0  # is not made up for
    env.step(AHEAD)
    env.step(AHEAD)
    monkeypatch.undo()
    assert waits == pytest.approx([0.05, 0.05, 0.03, 0.0, 0.05])


def test_the_argument_for_the_port_precedes_the_variable(
    make: Make, room: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        monkeypatch.setenv("FLATLAND_WEB_PORT", str(port))
        with pytest.raises(FlatlandError, match=f"port {port}"):
            make(FlatlandEnv, room, render_mode="human").reset(seed=0)
        env = make(FlatlandEnv, room, render_mode="human", web_port=0)
        env.reset(seed=0)
        assert f":{port}/" not in printed_urls(capsys)[0]


def test_without_a_port_another_one_replaces_the_default_that_is_in_use(
    make: Make, room: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("FLATLAND_WEB_PORT")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        monkeypatch.setattr(live_view, "WEB_PORT", taken.getsockname()[1])
        make(FlatlandEnv, room, render_mode="human").reset(seed=0)
        (url,) = printed_urls(capsys)
    with WebClient(url) as client:
        assert client.pose("robot")


@pytest.mark.parametrize("kind", [FlatlandEnv, FlatlandVectorEnv, FleetEnv])
def test_an_invalid_port_is_an_error(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for port in (-1, 65536, True, "8000"):
        with pytest.raises(ValueError, match="web_port must be an integer from 0 to 65535, got"):
            kind(render_mode="human", web_port=port)
    monkeypatch.setenv("FLATLAND_WEB_PORT", "http")
    with pytest.raises(ValueError, match=r"FLATLAND_WEB_PORT must be .* got 'http'"):
        kind(render_mode="human")


def test_the_page_opens_in_a_browser_if_there_is_a_display(
    make: Make, room: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(live_view.webbrowser, "open", opened.append)
    monkeypatch.setenv("DISPLAY", ":77")
    make(FlatlandEnv, room, render_mode="human").reset(seed=0)
    assert opened == printed_urls(capsys)


def test_a_forked_process_has_a_viewer_of_its_own(room: Path) -> None:
    """As with `gymnasium.vector.AsyncVectorEnv`."""
    code = f"""
import os, sys
from flatland.gym import FlatlandEnv
env = FlatlandEnv({str(room)!r}, render_mode="human")
env.reset(seed=0)
child = os.fork()
if child == 0:
    env.close()
    other = FlatlandEnv({str(room)!r}, render_mode="human")
    other.reset(seed=0)
    other.close()
    os._exit(0)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    done = run_program(
        [sys.executable, "-W", "ignore", "-c", code], env=dict(os.environ), check=True
    )
    urls = re.findall(r"http://\S+", done.stderr)
    assert len(set(urls)) == 2, done.stderr
