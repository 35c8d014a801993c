"""Writes the recording of a run."""

from __future__ import annotations

import hashlib
import logging
import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flatland.errors import WorldError
from flatland.foreign_texts import text_of
from flatland.plugin_api.ports import Command
from flatland.recording.log_file import FORMAT, LogWriter, Record, RecordingWriteError, encode_value
from flatland.runtime.observer import WorldObserver
from flatland.timekeeper import NANOSECONDS
from flatland.uncopied import uncopied
from flatland.version import VERSION

if TYPE_CHECKING:
    from flatland.physics import PhysicsWorld
    from flatland.world import World

_LOG = logging.getLogger("flatland")


@uncopied("World.record() starts another recording")
class Recorder(WorldObserver):
    """Records one world, from before its first step until `close`; created by `World.record`.

    If the file cannot be written, an error is logged and the recording ends; the simulation
    continues.

    Attributes:
        error: Why the recording is incomplete, with the step at which it ends; empty if it is not.
    """

    def __init__(self, world: World, path: str | os.PathLike[str]) -> None:
        """Creates the file and writes its header.

        Args:
            world: The world, as it was loaded.
            path: The file; an existing one is replaced.

        Raises:
            WorldError: The world was not loaded from a file, or has changed since.
            RecordingError: The file cannot be written.
        """
        timekeeper = world.timekeeper
        if not world.path:
            raise WorldError("only a world that was loaded from a file can be recorded")
        if (
            timekeeper.sim_time_ns
            or world.change_count
            or world.ports.commands_received() != world.source.commands_received
        ):
            raise WorldError(
                "a recording must start before the first step, command and request of a world"
            )
        self._world = world
        self._timekeeper = timekeeper
        self._depth = 0
        self._step = 0  # number of recorded steps; the time may be set back
        self._known_files: set[str] = set()
        self._known_params: dict[str, object] = {}
        self._checksums: list[int] = []
        self._next_hash_ns = NANOSECONDS
        self._unrecordable: set[str] = set()
        self.error = ""
        self._writer: LogWriter | None = LogWriter(path)
        try:
            self._writer.write(
                {
                    "format": FORMAT,
                    "flatland": VERSION,
                    "world": world.path,
                    "seed": world.seed,
                    "step_size_ns": timekeeper.step_size_ns,
                    "simplify_map": world.source.simplify_map,
                    "plugin_errors": world.plugin_errors,
                    "on_invalid_body": world.on_invalid_body,
                    "model_path": world.model_path,
                    "state": world.state_hash(),
                    **self._new_inputs(),
                }
            )
        except BaseException:
            self._writer.close()
            raise
        for commands in world.ports.commands.values():
            for command in commands:
                self.command_opened(command)

    @property
    def is_open(self) -> bool:
        """Whether the recording is being written."""
        return self._writer is not None

    def command_opened(self, command: Command[Any]) -> None:
        """Records the values of a command from now on."""
        command.on_set = self._command_set

    # -- changes ---------------------------------------------------------------------------

    @contextmanager
    def change(self, kind: str, arguments: Mapping[str, object]) -> Iterator[None]:
        """Records a request and its outcome, but not the requests of plugins in the block."""
        if self._depth or self._writer is None:
            yield
            return
        self._write(kind, arguments={key: encode_value(v) for key, v in arguments.items()})
        self._depth += 1
        error: BaseException | None = None
        try:
            yield
        except BaseException as raised:
            error = raised
            raise
        finally:
            self._depth -= 1
            text = None if error is None else f"{type(error).__name__}: {text_of(error)}"
            self._write("result", error=text, **self._new_inputs())

    @contextmanager
    def repeated(self) -> Iterator[None]:
        """Suspends the recording during a change that a hook has requested."""
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1

    def _command_set(self, command: Command[Any], value: Any) -> None:
        # Values set by hooks, and by plugins within a request, are repeated by the same plugins.
        if self._depth or self._world.requests.in_hook or self._writer is None:
            return
        try:
            encoded = encode_value(value)
        except TypeError as error:
            if command.topic not in self._unrecordable:
                self._unrecordable.add(command.topic)
                _LOG.warning(
                    "command %s cannot be recorded, and the run cannot be repeated: %s",
                    command.topic,
                    error,
                )
            self._write("lost", topic=command.topic)
            return
        number = self._world.ports.commands[command.topic].index(command)
        self._write("command", topic=command.topic, number=number, value=encoded)

    def step_done(self) -> None:
        """Adds the checksum of the bodies, and each simulated second the hash of the world."""
        if self._writer is None:
            return
        self._step += 1
        self._checksums.append(checksum(self._world.physics))
        if self._step * self._timekeeper.step_size_ns >= self._next_hash_ns:
            self._next_hash_ns += NANOSECONDS
            self._write_hash("state")

    # -- end -------------------------------------------------------------------------------

    def world_closing(self) -> None:
        """Ends the recording with the world."""
        self.close()

    def close(self) -> None:
        """Writes the last state and ends the recording; idempotent."""
        if self._writer is None:
            return
        self._write_hash("end")
        self._stop()

    def _stop(self) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()
        for commands in self._world.ports.commands.values():
            for command in commands:
                command.on_set = None

    def _write_hash(self, kind: str) -> None:
        checksums, self._checksums = self._checksums, []
        self._write(
            kind, state=self._world.state_hash(), bodies="".join(f"{c:08x}" for c in checksums)
        )

    def _write(self, kind: str, **fields: Any) -> None:
        if self._writer is None:
            return
        record: Record = {"step": self._step, "kind": kind, **fields}
        try:
            self._writer.write(record)
        except RecordingWriteError as error:
            self.error = f"{error.reason}, at step {self._step}"
            _LOG.error("%s; the recording ends at step %d", error, self._step)
            self._stop()

    def _new_inputs(self) -> Record:
        """Returns the digests of files and the parameters that were read since the last call."""
        inputs = self._world.source.inputs
        files = [path for path in inputs.files if path not in self._known_files]
        params = {
            name: encode_value(value)
            for name, value in inputs.params.items()
            if name not in self._known_params or self._known_params[name] != value
        }
        self._known_files.update(files)
        self._known_params.update(inputs.params)
        return {"files": digests(files), "params": params}


def checksum(physics: PhysicsWorld) -> int:
    """Returns the CRC-32 of the states of all bodies."""
    return zlib.crc32(physics.body_states().data)


def digests(paths: Iterable[str]) -> dict[str, str | None]:
    """Returns the SHA-256 digest of each file in hexadecimal; None for an unreadable file."""
    result: dict[str, str | None] = {}
    for path in paths:
        try:
            with Path(path).open("rb") as file:
                result[path] = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:
            result[path] = None
    return result
