"""`flatland run`: simulates a world without ROS, as fast as possible."""

from __future__ import annotations

import argparse
import math
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import yaml

from flatland.cli.arguments import (
    Commands,
    add_command,
    add_step_size,
    count,
    file_arguments,
    load,
    picture_arguments,
    picture_options,
    positive,
)
from flatland.cli.contents import counted
from flatland.cli.outputs import Recordings, path_with, recording_arguments
from flatland.cli.progress import StopSignals, progress_bar
from flatland.drawing import VIDEO_FORMATS, FrameRenderer, VideoFile, check_matplotlib, check_opencv
from flatland.errors import FlatlandError
from flatland.foreign_texts import text_of
from flatland.output_files import check_outputs, replaced
from flatland.runtime.plain_commands import set_command
from flatland.world import World

_EXAMPLES = (
    "flatland run worlds/office/world.yaml --duration 60",
    "flatland run worlds/office/world.yaml --duration 5 --seed 1 --bag office.bag",
    "flatland run worlds/office/world.yaml --duration 5 --mcap office.mcap --record office.flog",
    "flatland run worlds/office/world.yaml --duration 2 --video office.mp4 --size 640x480 "
    '--command "/cmd_vel={linear: {x: 0.5}, angular: {z: 0.3}}"',
)
_MAX_CHUNK = 0.05  # s of wall time between two updates of the progress bar


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "run",
        parents=[
            file_arguments("WORLD", "world file"),
            recording_arguments(),
            picture_arguments(),
        ],
        summary="simulate a world as fast as possible, into a bag or a video",
        description="Simulates a world without ROS, as fast as possible, and optionally writes all "
        "outputs and transforms to a bag, or a video. After Ctrl-C the files contain what has been "
        "simulated until then; after an error they are removed, apart from the recording. The exit "
        "code is 1 if a file is incomplete, for example because the disk is full.",
        examples=_EXAMPLES,
    )
    parser.add_argument(
        "--duration",
        type=positive,
        required=True,
        metavar="SECONDS",
        help="simulated time",
    )
    parser.add_argument("--seed", type=count, help="seed of all noise (default: random, printed)")
    add_step_size(parser)
    parser.add_argument(
        "--command",
        type=_command,
        action="append",
        default=[],
        metavar="TOPIC=YAML",
        help="command from the start on, in the form of rostopic pub; may be given several times",
    )
    parser.add_argument(
        "--record",
        type=Path,
        metavar="FILE",
        help="recording from which `flatland replay` repeats the run; an existing file is replaced",
    )
    parser.add_argument(
        "--video",
        type=path_with(VIDEO_FORMATS),
        metavar="FILE",
        help=f"video file ({', '.join(VIDEO_FORMATS)}); an existing file is replaced",
    )
    parser.add_argument(
        "--fps",
        type=positive,
        default=25.0,
        help="frames of the video per simulated second (default: 25)",
    )
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    check_outputs(options.video, options.record)
    if options.video:  # before loading, which may take long
        check_matplotlib()
        check_opencv()
    with StopSignals() as stop, ExitStack() as files:
        recordings = Recordings(options, files)
        observers = recordings.recorders.values()
        with load(options, options.seed, step_size=options.step_size, observers=observers) as world:
            recording = world.record(options.record) if options.record else None
            for topic, value in options.command:
                set_command(world, topic, value)
            video = _Video(options, world, files) if options.video else None
            start = time.perf_counter()
            _simulate(world, options.duration, video, stop)
            wall_time = time.perf_counter() - start
            _print_summary(world, wall_time, stop)
        if video is not None:
            video.close()
            print(f"wrote {options.video}: {counted(video.frames, 'frame')}")
        recordings.close()
    if recording is not None:
        if recording.error:
            print(f"flatland: {options.record} is incomplete: {recording.error}", file=sys.stderr)
        else:
            print(f"wrote {options.record}")
    if stop.signal:
        return 128 + stop.signal
    return 1 if recording is not None and recording.error else 0


def _print_summary(world: World, wall_time: float, stop: StopSignals) -> None:
    verb = "interrupted after" if stop.signal else "simulated"
    factor = world.time / wall_time if wall_time > 0 else math.inf
    print(
        f"{verb} {world.time:.12g} s in {wall_time:.3g} s ({factor:.3g} times real time), "
        f"seed {world.seed}"
    )


# -- stepping ------------------------------------------------------------------------------


def _simulate(world: World, duration: float, video: _Video | None, stop: StopSignals) -> None:
    """Steps a world until some simulated time, or until a signal.

    Raises:
        FlatlandError: A plugin raised an exception.
    """
    step_size = world.timekeeper.step_size
    total = max(1, math.ceil(duration / step_size - 1e-9))
    done, chunk = 0, 1
    start = time.perf_counter()
    with progress_bar(total * step_size) as advance:
        while done < total and not stop.signal:
            until = total
            if video is not None:
                video.draw_due_frame()
                until = min(until, math.ceil(video.next_time / step_size - 1e-9))
            steps = max(1, min(chunk, until - done))
            began = time.perf_counter()
            try:
                world.step(steps)
            except (FlatlandError, OSError):
                raise
            except Exception as error:
                raise FlatlandError(
                    f"stopped at {world.time:.12g} s: {type(error).__name__}: {text_of(error)}"
                ) from error
            now = time.perf_counter()
            if steps == chunk:
                chunk = chunk * 2 if now - began < _MAX_CHUNK / 2 else max(1, chunk // 2)
            done += steps
            advance(steps * step_size, done * step_size / (now - start))


# -- video ---------------------------------------------------------------------------------


class _Video:
    """The video of a run.

    Attributes:
        next_time: Simulated time of the next frame [s].
    """

    def __init__(self, options: argparse.Namespace, world: World, files: ExitStack) -> None:
        part = files.enter_context(replaced(options.video))
        try:
            self._renderer = FrameRenderer(world, **picture_options(options))
        except ValueError as error:
            options.parser.error(str(error))
        self._file = VideoFile(part, options.fps, self._renderer.size)
        files.callback(self._file.close)
        self._world = world
        self._fps = options.fps
        self.next_time = 0.0

    @property
    def frames(self) -> int:
        """Number of frames written."""
        return self._file.frames

    def draw_due_frame(self) -> None:
        """Draws a frame if the time of the next one has come."""
        while self._world.time >= self.next_time - 1e-9:
            self._file.write(self._renderer.picture())
            self.next_time = self.frames / self._fps

    def close(self) -> None:
        """Completes the file."""
        self._file.close()


# -- commands to robots --------------------------------------------------------------------


def _command(text: str) -> tuple[str, Any]:
    topic, equals, value = text.partition("=")
    try:
        if topic and equals:
            return topic, yaml.safe_load(value)
    except yaml.YAMLError:
        pass
    raise argparse.ArgumentTypeError(
        f"must be TOPIC=YAML, as in '/cmd_vel={{linear: {{x: 0.5}}}}', got {text!r}"
    )
