"""`flatland view`."""

from __future__ import annotations

import re
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from flatland_command import main
from programs import Program
from raw_web_client import RawWebClient
from waiting import wait_until

QUIET = ("--port", "0", "--no-browser")


@contextmanager
def shown(*arguments: str) -> Iterator[tuple[Program, str]]:
    """Starts the command; yields the program and the address that it prints."""
    program = Program([sys.executable, "-W", "error", "-m", "flatland", "view", *arguments, *QUIET])
    try:
        yield program, program.wait_for_line(r"^\S+ is shown at (http://\S+)$")[1]
    finally:
        program.kill()


def test_the_world_is_shown_until_an_interrupt(world_file):
    with shown(world_file, "--seed", "1") as (program, url):
        with RawWebClient(url) as client:
            assert client.wait_model("robot")
            assert client.wait("status", lambda message: message["time"] > 0.2)["rate"] == 200
            assert client.wait("status")["paused"] is False
            program.send(signal.SIGINT)
            assert client.wait_closed()[0] == 1001
        assert program.wait() == 130
        assert len(program.lines) == 1, program.output


def test_the_options(world_file):
    options = ["--paused", "--rate", "50", "--read-only", "--step-size", "0.01"]
    tokens = ("--token", "open the sesame!", "--view-token", "sesame for viewers")
    with shown(world_file, *options, *tokens) as (program, url):
        assert url.endswith("/?token=open%20the%20sesame%21")
        program.wait_for_line(r"^for viewers: \S+/\?token=sesame%20for%20viewers$")
        with RawWebClient(url, look=False) as client:
            assert client.wait("hello")["read_only"]
            client.ask("look", worlds=[0])
            status = client.wait("status")
            assert (status["paused"], status["rate"], status["time"]) == (True, 50, 0)
            world = [m for m in client.received if isinstance(m, dict) and m["type"] == "world"]
            assert world[0]["step_size"] == 0.01
            program.send(signal.SIGTERM)
            assert client.wait_closed()[0] == 1001
        assert program.wait() == 143
        assert len(program.lines) == 2, program.output


def test_it_ends_after_the_duration(world_file, capsys):
    assert main("view", world_file, *QUIET, "--rate", "0", "--duration", "0.5") == 0
    assert re.fullmatch(r"\S+ is shown at http://127.0.0.1:\d+/\n", capsys.readouterr().out)


def test_other_machines_need_a_token(world_file, capsys):
    assert main("view", world_file, *QUIET, "--host", "0.0.0.0", "--duration", "0.1") == 0
    assert re.search(r" at http://\S+:\d+/\?token=\S{20,}\n", capsys.readouterr().out)


def test_a_browser_is_opened_if_there_is_a_display(world_file, monkeypatch, capsys):
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    assert main("view", world_file, "--port", "0", "--duration", "0.1") == 0
    assert opened == []
    monkeypatch.setenv("DISPLAY", ":99")
    assert main("view", world_file, *QUIET, "--duration", "0.1") == 0
    assert opened == []
    assert main("view", world_file, "--port", "0", "--duration", "0.1") == 0
    wait_until("a browser is opened", lambda: opened)
    assert opened == [capsys.readouterr().out.split()[-1]]


def test_a_port_in_use_is_an_error_before_the_world_is_loaded(world_file, capsys):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        assert main("view", "nothing.yaml", "--port", str(port), "--no-browser") == 1
    error = capsys.readouterr().err
    assert error == (
        f"flatland: the viewer cannot listen on port {port} of '127.0.0.1': Address already in use "
        "(hint: choose another port; 0 for any free one)\n"
    )


def test_an_invalid_world_is_an_error(capsys):
    assert main("view", "nothing.yaml", *QUIET) == 1
    assert "nothing.yaml" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "error"),
    [
        (("--port", "70000"), "must be an integer from 0 to 65535, got '70000'"),
        (("--port", "x"), "must be an integer from 0 to 65535, got 'x'"),
        (("--token", 15 * "a"), "must have at least 16 characters, and no control characters"),
        (("--view-token", 16 * "\n"), "and no control characters"),
        (("--rate", "-1"), "must be a number above 0, got '-1'"),
        (("--step-size", "0"), "must be a number above 0, got '0'"),
    ],
)
def test_invalid_options_are_errors(world_file, capsys, option, error):
    with pytest.raises(SystemExit, match="2"):
        main("view", world_file, *option)
    assert error in capsys.readouterr().err
