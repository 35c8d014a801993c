"""`flatland replay`: repeats a recorded run and compares it with the recording."""

from __future__ import annotations

import argparse
import time
from contextlib import ExitStack, suppress
from pathlib import Path

from flatland.cli.arguments import Commands, add_command
from flatland.cli.browser import open_page
from flatland.cli.contents import counted
from flatland.cli.outputs import Recordings, recording_arguments
from flatland.cli.progress import StopSignals, progress_bar
from flatland.recording import Replay

_EXAMPLES = (
    "flatland replay office.flog",
    "flatland replay office.flog --bag office.bag",
    "flatland replay office.flog --view",
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
        "recording; the first step that differs is printed.",
        examples=_EXAMPLES,
    )
    parser.add_argument("path", type=Path, metavar="RECORDING", help="recording")
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
        _repeat(replay, stop, in_real_time=options.view)
        recordings.close()
        return _report(replay, stop)


def _repeat(replay: Replay, stop: StopSignals, in_real_time: bool) -> None:
    """Repeats the run until its end, a difference or a signal."""
    step_size = replay.world.timekeeper.step_size
    start = shown_at = time.perf_counter()
    shown = 0
    with progress_bar(replay.last_step * step_size) as advance:

        def on_step(step: int) -> None:
            nonlocal shown, shown_at
            if stop.signal:
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
    """A signal ends the replay."""


def _report(replay: Replay, stop: StopSignals) -> int:
    recording, step_size = replay.recording, replay.world.timekeeper.step_size
    time_of = "{} ({:.12g} s)".format
    if stop.signal:
        print(f"interrupted after {time_of(counted(replay.step, 'step'), replay.world.time)}")
        return 128 + stop.signal
    difference = replay.difference
    if difference is not None:
        place = time_of(f"step {difference.step}", difference.step * step_size)
        print(f"{recording.path}: the first difference is at {place}: {difference.text}")
        return 1
    done = time_of(counted(replay.step, "step"), replay.world.time)
    print(f"{recording.path}: {done}, no difference")
    if recording.is_cut or recording.records[-1].get("kind") != "end":
        print("the recording has no end: the program that wrote it was killed")
    return 0
