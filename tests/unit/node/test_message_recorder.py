"""What a recorder of messages writes, with a file of the test."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

import flatland
from flatland.node.message_recorder import MessageRecorder
from flatland.node.stamps import FIRST_TIME
from flatland.node.transport import Adapter
from flatland.node.values import Transforms

STEP_NS = 5_000_000
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, enable_odom_tf_pub: true}
  - {type: Laser, name: laser, body: base, range: 20, angle: {min: 0, max: 1, increment: 1},
     update_rate: 100}
"""
WORLD = "{properties: {}, layers: [{name: 2d}], models: [{name: r, model: robot.model.yaml}]}"


class File:
    """A file in memory, and the adapters of values.

    Attributes:
        written: Topic, class, value, time [ns] and number of each message.
        finished: How often the file was completed.
        error: Raised by each write.
        adapters: By type of values: whether there is none (None), or whether it serializes.
    """

    def __init__(self) -> None:
        self.written: list[tuple[str, Any, Any, int, int]] = []
        self.finished = 0
        self.error: Exception | None = None
        self.adapters: dict[type[Any], str] = {}

    def find_adapter(self, kind: type[Any]) -> Adapter | None:
        how = self.adapters.get(kind, "bytes")
        to_message: Callable[[Any], Any] | None = lambda value: ("message", value)  # noqa: E731
        serialize: Callable[[Any], Any] | None = lambda value: value  # noqa: E731
        if how == "missing":
            return None
        if how != "bytes":
            serialize = None
        if how == "receive":
            to_message = None
        return Adapter(kind, kind, to_message, lambda message: message, serialize)

    def serialize(self, message: Any) -> Any:
        kind, value = message
        assert kind == "message"
        return value

    def write(self, topic: str, kind: Any, data: Any, time_ns: int, number: int) -> None:
        if self.error is not None:
            raise self.error
        self.written.append((topic, kind, data, time_ns, number))

    def finish(self) -> None:
        self.finished += 1
        if self.error is not None:
            raise self.error

    def recorder(self, **options: Any) -> MessageRecorder:
        return MessageRecorder(
            self.find_adapter, self.serialize, self.write, self.finish, **options
        )

    def of(self, topic: str) -> list[tuple[int, int]]:
        """Returns times [ns] and numbers of the messages of a topic."""
        return [(time_ns, number) for name, _, _, time_ns, number in self.written if name == topic]


@pytest.fixture
def file() -> File:
    return File()


@pytest.fixture
def load(files: Any) -> Callable[..., Any]:
    files.write("robot.model.yaml", ROBOT)
    return lambda *observers: files.load(WORLD, observers=list(observers))


def test_outputs_and_transforms_are_recorded_at_their_times(file: File, load: Any) -> None:
    recorder = file.recorder()
    world = load(recorder)
    world.step(4)
    assert file.of("/scan") == [(FIRST_TIME, 0), (2 * STEP_NS, 1)]
    assert [kind for topic, kind, *_ in file.written if topic == "/scan"] == [
        flatland.LaserScan
    ] * 2
    odometry = file.of("/odometry/filtered")
    assert [number for _, number in odometry] == list(range(len(odometry)))
    assert file.of("/tf")
    for topic, kind, value, time_ns, number in file.written:
        if topic == "/tf":
            assert kind is Transforms
            assert isinstance(value, Transforms)
            assert (time_ns, number) == (max(FIRST_TIME, *(each.stamp for each in value)), 0)
    assert recorder.topics == {topic for topic, *_ in file.written}
    assert recorder.messages == len(file.written)
    for _ in range(2):
        recorder.close()
    assert file.finished == 1
    count = len(file.written)
    world.output("/scan").emit(world.output("/scan").latest)
    assert len(file.written) == count


def test_a_world_that_is_already_loaded_is_recorded_from_then_on(file: File, load: Any) -> None:
    world = load()
    world.step(2)
    recorder = file.recorder()
    recorder.observe(world)
    world.step(2)
    assert file.of("/scan") == [(2 * STEP_NS, 0)]
    assert file.of("/tf")
    output = world.output("/scan")
    recorder.output_closed(output)
    recorder.output_closed(output)
    world.step(2)
    assert file.of("/scan") == [(2 * STEP_NS, 0)]
    world.delete_model("r")
    world.step(2)
    assert file.of("/scan") == [(2 * STEP_NS, 0)]
    recorder.close()


def test_values_without_bytes_are_converted_by_their_messages(file: File, load: Any) -> None:
    file.adapters = {flatland.LaserScan: "message", Transforms: "message"}
    world = load(file.recorder())
    world.step(2)
    [scan] = [value for topic, _, value, *_ in file.written if topic == "/scan"]
    assert isinstance(scan, flatland.LaserScan)
    assert isinstance(
        next(value for topic, _, value, *_ in file.written if topic == "/tf"), Transforms
    )


@pytest.mark.parametrize("adapter", ["missing", "receive"])
def test_an_output_without_an_adapter_is_a_warning(
    file: File, load: Any, caplog: pytest.LogCaptureFixture, adapter: str
) -> None:
    file.adapters = {flatland.LaserScan: adapter}
    recorder = file.recorder()
    world = load(recorder)
    world.step(2)
    assert file.of("/scan") == []
    assert "/odometry/filtered" in recorder.topics
    text = 'output "/scan" is not recorded: no adapter for LaserScan is registered'
    assert [record.getMessage() for record in caplog.records] == [text]
    world.delete_model("r")


@pytest.mark.parametrize("adapter", ["missing", "receive"])
def test_transforms_without_an_adapter_are_an_error(file: File, adapter: str) -> None:
    file.adapters = {Transforms: adapter}
    recorder = file.recorder()
    each: Any = SimpleNamespace(stamp=7)
    with pytest.raises(LookupError, match="no adapter publishes transforms"):
        recorder.transforms_sent([each])


def test_transforms_have_the_latest_of_their_stamps(file: File) -> None:
    recorder = file.recorder()
    transforms: Any = [SimpleNamespace(stamp=stamp) for stamp in (7, 9, 8)]
    for _ in range(2):
        recorder.transforms_sent(transforms)
    assert file.written == [("/tf", Transforms, Transforms(transforms), 9, 0)] * 2


def test_a_failing_file_raises_or_ends_the_recording(
    file: File, load: Any, caplog: pytest.LogCaptureFixture
) -> None:
    file.error = OSError("disk full")
    raising = file.recorder()
    with pytest.raises(OSError, match="disk full"):
        raising.transforms_sent([SimpleNamespace(stamp=1)])  # type: ignore[list-item]
    with pytest.raises(OSError, match="disk full"):
        raising.close()
    recorder = file.recorder(ends_on_error=True)
    world = load(recorder)
    world.step(4)
    counted = recorder.messages
    file.error = None
    world.step(4)
    assert file.written == []
    assert recorder.messages == counted
    recorder.close()
    assert file.finished == 2
    file.error = OSError("disk full")
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        ("ERROR", "the recording of messages ends: disk full")
    ]
    file.error = ValueError("cause")  # not an error of the file
    with pytest.raises(ValueError, match="cause"):
        file.recorder(ends_on_error=True).close()
