"""`World.view`: a world that a program steps itself, in a notebook or at an address."""

from __future__ import annotations

import re
import sys
import threading
import types
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import aiohttp
import pytest
from programs import run_program
from web_client import WebClient

import flatland
from flatland import World, WorldError

MODEL = """
bodies:
  - {name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}
plugins: [{type: DiffDrive, name: drive, body: base}]
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "robot.model.yaml").write_text(MODEL)
    path = tmp_path / "world.yaml"
    path.write_text(
        "{properties: {}, layers: [], models: [{name: robot, model: robot.model.yaml}]}"
    )
    return path


@pytest.fixture
def world(path: Path) -> Iterator[World]:
    with World.from_yaml(path, seed=1) as world:
        yield world


def test_the_page_shows_what_the_program_does(world, capsys):
    view = world.view()
    assert capsys.readouterr().err == f"flatland: {view.url}\n"
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=\S{16,}", view.url)
    with WebClient(view.url) as client:
        assert client.pose("robot") == (0, 0, 0), "also before the first step"
        world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0))
        world.step(100)
        client.until("motion", lambda: client.pose("robot")[0] == pytest.approx(0.5, abs=0.01))
        world.move_model("robot", (3, 4, 1))
        client.until("move", lambda: client.pose("robot") == pytest.approx((3, 4, 1)))
        # The page acts between two steps of the program, and while it does nothing.
        client.do("move", model=client.model("robot")["id"], pose=[-1, 0, 0])
        assert world.model("robot").pose == pytest.approx((-1, 0, 0))
        client.do("pause")
        before = world.time
        world.step(10)
        assert world.time == before
        client.do("step", n=10)
        client.until("steps", lambda: client.status()["time"] == pytest.approx(before + 0.05))
        client.do("resume")
    view.close()


def test_the_page_follows_a_program_in_a_loop(world):
    done = threading.Event()

    def program() -> None:
        while not done.is_set():
            world.step()

    with world.view() as view, WebClient(view.url) as client:
        thread = threading.Thread(target=program)
        thread.start()
        try:
            client.until("time", lambda: client.status()["time"] > 0.1)
            client.do("delete", model=client.model("robot")["id"])
        finally:
            done.set()
            thread.join()
    assert world.models == []


def test_a_notebook_shows_the_page_in_a_frame(world, monkeypatch, capsys):
    # What IPython is in the kernel of a notebook.
    shell = types.SimpleNamespace(kernel=object())
    ipython = types.SimpleNamespace(get_ipython=lambda: shell)
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    view = world.view(height=300)
    assert capsys.readouterr().err == "", "the cell shows the view itself"
    frame = ElementTree.fromstring(view._repr_html_())
    assert (frame.tag, frame.get("src"), frame.get("height")) == ("iframe", view.url, "300")
    view.close()
    assert "<iframe" not in view._repr_html_()
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: None))
    assert world.view().url in capsys.readouterr().err, "IPython is imported, but not used"


def test_a_further_call_replaces_the_view(world):
    first = world.view()
    second = world.view(token="a known token of a view", read_only=True)
    assert first.closed
    assert "closed" in repr(first)
    assert second.url.endswith("?token=a%20known%20token%20of%20a%20view")
    assert second.url in repr(second)
    with pytest.raises(aiohttp.ClientConnectorError):
        WebClient(first.url)
    with WebClient(second.url) as client:
        assert client.hello["read_only"]
    # A clone is another world.
    with world.clone() as clone:
        third = clone.view()
        assert not second.closed
        assert third.world is clone


def test_the_view_ends_with_the_world(path):
    world = World.from_yaml(path, seed=1)
    view = world.view()
    with WebClient(view.url) as client:
        assert client.pose("robot")
        world.close()
        with pytest.raises(ConnectionError):
            client.until("the end", lambda: False)
    assert view.closed
    view.close()
    assert not [thread for thread in threading.enumerate() if thread.name == "flatland-web"]
    with pytest.raises(WorldError, match="closed"):
        world.view()


def test_snapshots_do_not_contain_the_view(world):
    snapshot = world.snapshot()
    with world.view() as view, WebClient(view.url) as client:
        world.step(10)
        shown = world.state_hash()
        world.restore(snapshot)
        assert not view.closed
        client.until("restored", lambda: client.status()["time"] == 0)
        world.step(10)
        assert world.state_hash() == shown


@pytest.mark.parametrize("arguments", [{"height": 0}, {"port": -1}, {"port": 65536}])
def test_an_invalid_argument_is_an_error(world, arguments):
    with pytest.raises(ValueError, match=next(iter(arguments))):
        world.view(**arguments)


def test_a_program_ends_although_the_view_is_open(path):
    code = "import sys, flatland; flatland.World.from_yaml(sys.argv[1]).view(); print('end')"
    done = run_program([sys.executable, "-c", code, path], check=True)
    assert done.stdout == "end\n"
    assert "Traceback" not in done.stderr
