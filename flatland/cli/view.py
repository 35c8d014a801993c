"""`flatland view`: simulates a world in real time and shows it in browsers."""

from __future__ import annotations

import argparse
import math
import threading
from typing import TYPE_CHECKING

from flatland.cli.arguments import (
    Commands,
    add_command,
    add_step_size,
    count,
    file_arguments,
    load,
    positive,
)
from flatland.cli.browser import open_page
from flatland.cli.progress import StopSignals
from flatland.defaults import WEB_HOST, WEB_MIN_TOKEN, WEB_PORT
from flatland.simulation import Simulation

if TYPE_CHECKING:
    from flatland.web import WebViewer

_EXAMPLES = (
    "flatland view worlds/office/world.yaml",
    "flatland view worlds/office/world.yaml --host 0.0.0.0 --read-only",
    "flatland view worlds/office/world.yaml --port 0 --no-browser --rate 400 --duration 10",
)
_CHECK_PERIOD = 0.1  # s between two checks for a signal


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "view",
        parents=[file_arguments("WORLD", "world file")],
        summary="simulate a world in real time and show it in a browser",
        description="Simulates a world without ROS in real time and shows it in a browser, where "
        "models can be spawned, moved, driven and deleted. Prints the address of the page, and "
        "runs until Ctrl-C. Only this machine can connect, unless --host is given; others need "
        "the token in the address.",
        examples=_EXAMPLES,
    )
    parser.add_argument(
        "--host",
        default=WEB_HOST,
        metavar="ADDRESS",
        help=f"address to listen on; 0.0.0.0 for all of this machine (default: {WEB_HOST})",
    )
    parser.add_argument(
        "--port",
        type=_port,
        default=WEB_PORT,
        help=f"TCP port, 0 for any free one (default: {WEB_PORT})",
    )
    parser.add_argument(
        "--token",
        type=_token,
        help="secret that browsers must send (default: none for this machine, else random)",
    )
    parser.add_argument(
        "--view-token",
        type=_token,
        metavar="TOKEN",
        help="another secret, with which browsers cannot change the world; its address is printed",
    )
    parser.add_argument("--read-only", action="store_true", help="browsers cannot change the world")
    parser.add_argument(
        "--no-browser", action="store_true", help="do not open a browser if there is a display"
    )
    parser.add_argument(
        "--rate",
        type=_rate,
        metavar="HZ",
        help="steps per second of wall time, 0 for as many as possible (default: real time)",
    )
    parser.add_argument("--paused", action="store_true", help="begin with a paused world")
    parser.add_argument("--seed", type=count, help="seed of all noise (default: random)")
    add_step_size(parser)
    parser.add_argument(
        "--duration",
        type=positive,
        default=math.inf,
        metavar="SECONDS",
        help="simulated time after which the command ends (default: no end)",
    )
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    viewer = _create_viewer(options)
    with StopSignals() as stop:
        viewer.start()  # before loading, which may take long
        with (
            viewer,
            load(
                options,
                options.seed,
                step_size=options.step_size,
                plugin_errors="disable",
                on_invalid_body="remove",
            ) as world,
        ):
            if options.paused:
                world.pause()
            rate = 1 / options.step_size if options.rate is None else options.rate
            simulation = Simulation(world, rate)
            viewer.add_world(world, simulation=simulation)
            print(f"{options.path} is shown at {viewer.url}", flush=True)
            if viewer.view_url is not None:
                print(f"for viewers: {viewer.view_url}", flush=True)
            if not options.no_browser:
                open_page(viewer.url)
            ended = threading.Event()
            watch = threading.Thread(target=_stop_at_signal, args=[stop, simulation, ended])
            watch.start()
            try:
                simulation.run(options.duration)
            finally:
                ended.set()
                watch.join()
    return 128 + stop.signal if stop.signal else 0


def _create_viewer(options: argparse.Namespace) -> WebViewer:
    from flatland.web import WebViewer

    return WebViewer(
        options.host,
        options.port,
        token=options.token,
        view_token=options.view_token,
        read_only=options.read_only,
        title=f"{options.path.parent.name}/{options.path.name}".lstrip("/"),
    )


def _stop_at_signal(stop: StopSignals, simulation: Simulation, ended: threading.Event) -> None:
    while not ended.wait(_CHECK_PERIOD):
        if stop.signal:
            simulation.stop()
            return


# -- types of values -----------------------------------------------------------------------


def _port(text: str) -> int:
    if not (text.isdecimal() and text.isascii() and len(text) < 6 and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"must be an integer from 0 to 65535, got {text!r}")
    return int(text)


def _token(text: str) -> str:
    if len(text) < WEB_MIN_TOKEN or not text.isprintable():
        raise argparse.ArgumentTypeError(
            f"must have at least {WEB_MIN_TOKEN} characters, and no control characters"
        )
    return text


def _rate(text: str) -> float:
    return 0.0 if text.strip() in ("0", "0.0") else positive(text)
