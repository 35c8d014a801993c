"""`flatland replay`: repeats a recorded run and compares it with the recording."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path

from flatland.cli.arguments import Commands, add_command
from flatland.cli.browser import open_page
from flatland.cli.contents import counted
from flatland.cli.outputs import Recordings, recording_arguments
from flatland.cli.progress import StopSignals, progress_bar
from flatland.errors import FlatlandError
from flatland.recording import Replay

_EXAMPLES = (
    "flatland replay office.flog",
    "flatland replay office.flog --bag office.bag",
    "flatland replay office.flog --view",
    "flatland replay flatland-test --view",
)
_UPDATE_PERIOD = 0.05  # s of wall time between two updates of the progress bar


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "replay",
        parents=[recording_arguments()],
        summary="repeat a recorded run and compare it with the recording",
        description="Repeats a run from a recording of `flatland run --record`, of "
        "`flatland test`, of the node (record:=FILE) or of World.record, without ROS and as fast "
        "as possible, or with --view in real time. The exit code is 1 if the run differs from the "
        "recording, whose first step that differs is printed, or if the recording is incomplete. "
        "With the folder of a report of `flatland test`, the report is shown until Ctrl-C, and its "
        "links replay the runs.",
        examples=_EXAMPLES,
    )
    parser.add_argument(
        "path", type=Path, metavar="PATH", help="recording, or with --view a folder of results"
    )
    parser.add_argument(
        "--ignore-changes",
        action="store_true",
        help="repeat the run even if files have changed since the recording",
    )
    parser.add_argument(
        "--view",
        action="store_true",
        help="show the run in a browser, in real time; the address is printed",
    )
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.path.is_dir():
        return _serve(options)
    with StopSignals() as stop, ExitStack() as files:
        recordings = Recordings(options, files)
        replay = Replay(
            options.path,
            check_files=not options.ignore_changes,
            observers=recordings.recorders.values(),
        )
        files.callback(replay.close)
        if options.view:
            view = files.enter_context(replay.world.view(read_only=True))
            open_page(view.url)
        _repeat(replay, lambda: stop.signal, in_real_time=options.view)
        recordings.close()
        return _report(replay, stop.signal)


def _serve(options: argparse.Namespace) -> int:
    """Shows the report of a folder, whose links replay runs, until a signal."""
    from flatland.cli.report_server import REPORT, ReportServer  # requires the viewer

    folder = options.path
    if not options.view or options.bag is not None or options.mcap is not None:
        options.parser.error("a folder of results requires --view, without --bag and --mcap")
    if not (folder / REPORT).is_file():
        options.parser.error(f"{folder} contains no {REPORT} of `flatland test`")

    def repeat(replay: Replay, is_stopped: Callable[[], object]) -> None:
        try:
            _repeat(replay, is_stopped, in_real_time=True)
        except FlatlandError as error:
            print(f"{replay.recording.path}: {error}", file=sys.stderr)
            return
        if not is_stopped():
            _report(replay)
            sys.stdout.flush()  # The program runs on.

    def load(file: Path) -> Replay:
        return Replay(file, check_files=not options.ignore_changes)

    with StopSignals() as stop, ReportServer(folder, load, repeat) as server:
        print(f"{folder / REPORT} is shown at {server.url}", flush=True)
        open_page(server.url)
        while not stop.signal:
            server.handle_request()
    return 128 + stop.signal


def _repeat(replay: Replay, is_stopped: Callable[[], object], in_real_time: bool) -> None:
    """Repeats the run until its end, a difference or a stop."""
    step_size = replay.world.timekeeper.step_size
    start = shown_at = time.perf_counter()
    shown = 0
    with progress_bar(replay.last_step * step_size) as advance:

        def on_step(step: int) -> None:
            nonlocal shown, shown_at
            if is_stopped():
                raise _InterruptedError
            if in_real_time:
                time.sleep(max(0.0, start + step * step_size - time.perf_counter()))
            now = time.perf_counter()
            if now - shown_at >= _UPDATE_PERIOD or step == replay.last_step:
                advance((step - shown) * step_size, step * step_size / (now - start))
                shown, shown_at = step, now

        with suppress(_InterruptedError):
            replay.run(on_step)


class _InterruptedError(Exception):
    """The replay is stopped."""


def _report(replay: Replay, signal: int = 0) -> int:
    recording, step_size = replay.recording, replay.world.timekeeper.step_size
    time_of = "{} ({:.12g} s)".format
    if signal:
        print(f"interrupted after {time_of(counted(replay.step, 'step'), replay.world.time)}")
        return 128 + signal
    difference = replay.difference
    if difference is not None:
        place = time_of(f"step {difference.step}", difference.step * step_size)
        print(f"{recording.path}: the first difference is at {place}: {difference.text}")
        return 1
    done = time_of(counted(replay.step, "step"), replay.world.time)
    print(f"{recording.path}: {done}, no difference")
    if recording.is_complete:
        return 0
    print(
        "the recording is incomplete, and nothing after these steps was compared: the program that "
        "wrote it was killed, or could not write all of it"
    )
    return 1
