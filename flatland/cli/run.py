"""`flatland run`: simulates a world without ROS, as fast as possible."""

from __future__ import annotations

import argparse
import dataclasses
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import yaml

from flatland.cli.arguments import (
    Commands,
    add_command,
    count,
    file_arguments,
    load,
    picture_arguments,
    picture_options,
    positive,
)
from flatland.cli.contents import counted
from flatland.drawing import VIDEO_FORMATS, FrameRenderer, VideoFile, check_matplotlib, check_opencv
from flatland.errors import FlatlandError
from flatland.world import World

if TYPE_CHECKING:
    from flatland.ros.bag import BagRecorder
    from flatland.runtime.observer import WorldObserver

_EXAMPLES = (
    "flatland run worlds/office/world.yaml --duration 60",
    "flatland run worlds/office/world.yaml --duration 5 --seed 1 --bag office.bag",
    "flatland run worlds/office/world.yaml --duration 2 --video office.mp4 --size 640x480 "
    '--command "/cmd_vel={linear: {x: 0.5}, angular: {z: 0.3}}"',
)
_MAX_CHUNK = 0.05  # s of wall time between two updates of the progress bar


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "run",
        parents=[file_arguments("WORLD", "world file"), picture_arguments()],
        summary="simulate a world as fast as possible, into a bag or a video",
        description="Simulates a world without ROS, as fast as possible, and optionally writes all "
        "outputs and transforms to a bag, or a video. After Ctrl-C the files contain what has been "
        "simulated until then; after an error they are removed.",
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
    parser.add_argument(
        "--step-size",
        type=positive,
        default=0.005,
        metavar="SECONDS",
        help="simulated time of one step (default: 0.005)",
    )
    parser.add_argument(
        "--command",
        type=_command,
        action="append",
        default=[],
        metavar="TOPIC=YAML",
        help="command from the start on, in the form of rostopic pub; may be given several times",
    )
    parser.add_argument(
        "--bag",
        type=_path_with((".bag",)),
        metavar="FILE",
        help="bag file (ROS 1) with all outputs and transforms; an existing file is replaced",
    )
    parser.add_argument(
        "--video",
        type=_path_with(VIDEO_FORMATS),
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


def _path_with(suffixes: Sequence[str]) -> Callable[[str], Path]:
    def path(text: str) -> Path:
        if Path(text).suffix.lower() not in suffixes:
            raise argparse.ArgumentTypeError(f"must end with {' or '.join(suffixes)}, got {text!r}")
        return Path(text)

    return path


def _run(options: argparse.Namespace) -> int:
    if options.video:  # before loading, which may take long
        check_matplotlib()
        check_opencv()
    with _StopSignals() as stop, ExitStack() as files:
        observers: list[WorldObserver] = []
        recorder = None
        if options.bag:
            recorder = _open_bag(files.enter_context(_replaced(options.bag)), files)
            observers.append(recorder)
        with load(options, options.seed, step_size=options.step_size, observers=observers) as world:
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
        if recorder is not None:
            recorder.close()
            topics = counted(len(recorder.topics), "topic")
            print(f"wrote {options.bag}: {counted(recorder.messages, 'message')}, {topics}")
    return 128 + stop.signal if stop.signal else 0


def _print_summary(world: World, wall_time: float, stop: _StopSignals) -> None:
    verb = "interrupted after" if stop.signal else "simulated"
    factor = world.time / wall_time if wall_time > 0 else math.inf
    print(
        f"{verb} {world.time:.12g} s in {wall_time:.3g} s ({factor:.3g} times real time), "
        f"seed {world.seed}"
    )


# -- stepping ------------------------------------------------------------------------------


def _simulate(world: World, duration: float, video: _Video | None, stop: _StopSignals) -> None:
    """Steps a world until some simulated time, or until a signal.

    Raises:
        FlatlandError: A plugin raised an exception.
    """
    step_size = world.timekeeper.step_size
    total = max(1, math.ceil(duration / step_size - 1e-9))
    done, chunk = 0, 1
    start = time.perf_counter()
    with _progress_bar(total * step_size) as advance:
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
                    f"stopped at {world.time:.12g} s: {type(error).__name__}: {error}"
                ) from error
            now = time.perf_counter()
            if steps == chunk:
                chunk = chunk * 2 if now - began < _MAX_CHUNK / 2 else max(1, chunk // 2)
            done += steps
            advance(steps * step_size, done * step_size / (now - start))


@contextmanager
def _progress_bar(seconds: float) -> Iterator[Callable[[float, float], None]]:
    """Shows a progress bar on the standard error output if it is a terminal.

    Args:
        seconds: Simulated time at the end.

    Yields:
        A function of the additional simulated time [s] and the real-time factor.
    """
    try:
        from tqdm import tqdm
    except ImportError:  # `flatland doctor` reports it
        yield lambda _seconds, _factor: None
        return
    form = "{percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s [{elapsed}<{remaining}{postfix}]"
    with tqdm(total=seconds, bar_format=form, disable=None, file=sys.stderr) as bar:

        def advance(more: float, factor: float) -> None:
            bar.set_postfix_str(f"{factor:.1f}x real time", refresh=False)
            bar.update(more)

        yield advance


class _StopSignals:
    """Replaces the handlers of SIGINT and SIGTERM; the first signal only ends the simulation.

    A second signal has its usual effect.

    Attributes:
        signal: The signal that was received, 0 for none.
    """

    def __init__(self) -> None:
        self.signal = 0
        self._previous: dict[int, Any] = {}

    def __enter__(self) -> _StopSignals:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._previous[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        self.signal = number
        self._restore()

    def _restore(self) -> None:
        while self._previous:
            signal.signal(*self._previous.popitem())


# -- files ---------------------------------------------------------------------------------


@contextmanager
def _replaced(path: Path) -> Iterator[Path]:
    """Yields a temporary path; the file becomes `path` at the end, and is removed on an error."""
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    try:
        yield part
        os.replace(part, path)  # noqa: PTH105
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def _open_bag(path: Path, files: ExitStack) -> BagRecorder:
    try:
        from flatland.ros.bag import BagRecorder
    except ImportError as error:
        raise FlatlandError(
            f"bags need the messages of ROS and rosbag ({error}): "
            "apt-get install python3-rosbag python3-tf2-msgs python3-nav-msgs python3-sensor-msgs"
        ) from error
    recorder = BagRecorder(path)
    files.callback(recorder.close)
    return recorder


class _Video:
    """The video of a run.

    Attributes:
        next_time: Simulated time of the next frame [s].
    """

    def __init__(self, options: argparse.Namespace, world: World, files: ExitStack) -> None:
        part = files.enter_context(_replaced(options.video))
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


def set_command(world: World, topic: str, value: Any) -> None:
    """Sets a command.

    Args:
        world: The world.
        topic: Resolved topic.
        value: Value of the type of the topic; for a dataclass such as `Twist` a dictionary with
            the names of its fields, where `{linear: {x: 1}}` is the same as `{linear_x: 1}`.

    Raises:
        FlatlandError: The topic does not exist, or the value has another form.
    """
    command = world.command(topic)
    kind = command.value_type
    if dataclasses.is_dataclass(kind) and isinstance(value, Mapping):
        names = [field.name for field in dataclasses.fields(kind)]
        fields = dict(_flat(value))
        wrong = [name for name in fields if name not in names]
        numbers = [name for name, part in fields.items() if isinstance(part, int | float)]
        if wrong or len(numbers) < len(fields):
            got = ", ".join(wrong) or f"{fields}"
            raise FlatlandError(
                f'command "{topic}": the fields of {kind.__name__} are the numbers '
                f"{', '.join(names)}, got {got}"
            )
        value = kind(**{name: float(part) for name, part in fields.items()})
    elif kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    try:
        command.set(value)
    except TypeError as error:
        raise FlatlandError(str(error)) from None


def _flat(value: Mapping[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Iterates over nested dictionaries, with the keys joined by underscores."""
    for key, part in value.items():
        if isinstance(part, Mapping):
            yield from _flat(part, f"{prefix}{key}_")
        else:
            yield f"{prefix}{key}", part
