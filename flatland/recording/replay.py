"""Repeats a recorded run and compares it with the recording."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from typing import Any, Final

from flatland.errors import FlatlandError
from flatland.recording.log_file import Record, RecordingError, decode_value, read_recording
from flatland.recording.recorder import checksum, digests
from flatland.runtime.observer import WorldObserver
from flatland.runtime.snapshot import WorldSnapshot
from flatland.timekeeper import NANOSECONDS
from flatland.uncopied import uncopied
from flatland.world import World

_MAX_LISTED: Final = 5  # changed files in an error message


@dataclass(frozen=True, slots=True)
class Difference:
    """The first point at which a repeated run differs from its recording.

    Attributes:
        step: The first step that differs; 0 for the loaded world. If the states of plugins differ,
            but not the states of bodies, the last step of the simulated second with the
            difference.
        text: What differs.
    """

    step: int
    text: str


@uncopied("create another Replay of the recording")
class Replay:
    """Repeats a recorded run in plain Python.

    Attributes:
        recording: The recording.
        world: The world of the repeated run.
        last_step: The last step of the recording.
        difference: The first difference that was found; None if there is none.
        step: Number of steps so far.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        check_files: bool = True,
        observers: Iterable[WorldObserver] = (),
    ) -> None:
        """Loads the world of a recording.

        Args:
            path: The recording.
            check_files: Whether to raise if a file has changed since the recording.
            observers: Receive notifications of the repeated run.

        Raises:
            RecordingError: The recording cannot be read, or a file has changed.
            FlatlandError: The world cannot be loaded.
        """
        self.recording = read_recording(path)
        header = self.recording.header
        if check_files:
            self._check_files(self.recording.records)
        self._params: dict[str, Any] = {}
        self._set_params(header)
        self.last_step: int = max((r["step"] for r in self.recording.records[1:]), default=0)
        self.difference: Difference | None = None
        self.step = 0
        self._snapshots: dict[int, WorldSnapshot] = {}  # by their numbers in the recording
        self._on_step: Callable[[int], object] | None = None
        # Checksums of the steps since the last comparison, and hashes of the steps with a recorded
        # hash. Both are taken at the same point of a step as by the recorder, before requests of
        # hooks are carried out.
        self._checksums: list[int] = []
        self._hash_steps = {r["step"] for r in self.recording.records[1:] if r["kind"] == "state"}
        self._hashes: dict[int, str] = {}
        self._first_checksum_step = 1
        self.world = World.from_yaml(
            header["world"],
            seed=header["seed"],
            params=self._params,
            simplify_map=header["simplify_map"],
            step_size=header["step_size_ns"] / NANOSECONDS,
            observers=observers,
            plugin_errors=header["plugin_errors"],
            on_invalid_body=header["on_invalid_body"],
        )
        with ExitStack() as undo:
            undo.enter_context(self.world)
            # Not an argument of `from_yaml`: these folders need not exist.
            folders = header.get("model_path")
            self.world.source.inputs.folders = None if folders is None else tuple(folders)
            self.world.log_changes(self)
            self._compare(header["state"], "the loaded world differs")
            undo.pop_all()

    @staticmethod
    def _check_files(records: list[Record]) -> None:
        recorded: dict[str, str | None] = {}
        for record in records:
            recorded |= record.get("files", {})
        now = digests(recorded)
        changed = [path for path, digest in recorded.items() if now[path] != digest]
        if changed:
            names = ", ".join(f'"{path}"' for path in changed[:_MAX_LISTED])
            more = f" and {len(changed) - _MAX_LISTED} more" if len(changed) > _MAX_LISTED else ""
            raise RecordingError(f"files have changed since the recording: {names}{more}")

    def run(self, on_step: Callable[[int], object] | None = None) -> Difference | None:
        """Repeats the run until its end, or until it differs from the recording.

        Args:
            on_step: Called with the number of steps after each step.

        Returns:
            The first difference; None if there is none.

        Raises:
            FlatlandError: The recording refers to something that does not exist.
        """
        self._on_step = on_step
        records = self.recording.records
        for index, record in enumerate(records[1:], 1):
            if self.difference is not None:
                break
            self.world.step(record["step"] - self.step)
            following = records[index + 1] if index + 1 < len(records) else None
            self._apply(record, following)
        return self.difference

    def close(self) -> None:
        """Closes the world."""
        self.world.close()

    # -- the log of the repeated run -------------------------------------------------------

    def change(self, kind: str, arguments: Mapping[str, object]) -> AbstractContextManager[None]:
        """Has no effect: the changes of the repeated run come from the recording."""
        del kind, arguments
        return nullcontext()

    def repeated(self) -> AbstractContextManager[None]:
        """Has no effect."""
        return nullcontext()

    def step_done(self) -> None:
        """Takes the checksum of the bodies, and the hash of the world if one was recorded."""
        self.step += 1
        self._checksums.append(checksum(self.world.physics))
        if self.step in self._hash_steps:
            self._hashes[self.step] = self.world.state_hash()
        if self._on_step is not None:
            self._on_step(self.step)

    def world_closing(self) -> None:
        """Has no effect: a replay has no file to complete."""

    # -- records ---------------------------------------------------------------------------

    def _apply(self, record: Record, following: Record | None) -> None:
        match record["kind"]:
            case "command":
                self._set_command(record)
            case "lost":
                self._differ(
                    self.step, f"a value of command {record['topic']} could not be recorded"
                )
            case "state" | "end" as kind:
                self._compare_bodies(record["bodies"])
                actual = self._hashes.pop(self.step) if kind == "state" else None
                self._compare(record["state"], "the state of a plugin differs", actual)
            case "result":
                pass
            case kind:
                self._change(kind, record["arguments"], following)

    def _set_command(self, record: Record) -> None:
        commands = self.world.ports.commands.get(record["topic"], [])
        if record["number"] >= len(commands):
            self._differ(self.step, f"command {record['topic']} does not exist")
            return
        commands[record["number"]].set(decode_value(record["value"]))

    def _change(self, kind: str, arguments: Record, following: Record | None) -> None:
        has_result = following is not None and following["kind"] == "result"
        if following is not None and has_result:
            self._set_params(following)
        error: str | None = None
        try:
            self._repeat(kind, {key: decode_value(v) for key, v in arguments.items()})
        except RecordingError:
            raise
        except (FlatlandError, ValueError) as raised:
            error = f"{type(raised).__name__}: {raised}"
        if following is not None and has_result and error != following["error"]:
            self._differ(
                self.step,
                f"{kind} {_outcome(following['error'])} in the recording, but {_outcome(error)}",
            )

    def _repeat(self, kind: str, arguments: dict[str, Any]) -> None:
        if kind == "snapshot":
            self._snapshots[arguments["number"]] = self.world.snapshot()
        elif kind == "restore":
            snapshot = self._snapshots.get(arguments["number"])
            if snapshot is None:
                self._differ(self.step, "the snapshot was taken before the recording started")
            else:
                self.world.restore(snapshot)
        elif kind in _CHANGES:
            _CHANGES[kind](self.world, **arguments)
        else:
            raise RecordingError(f'unknown request "{kind}" at step {self.step}')

    def _set_params(self, record: Record) -> None:
        self._params.update({n: decode_value(v) for n, v in record["params"].items()})

    # -- comparison ------------------------------------------------------------------------

    def _compare_bodies(self, recorded: str) -> None:
        expected = [int(recorded[i : i + 8], 16) for i in range(0, len(recorded), 8)]
        actual, self._checksums = self._checksums, []
        first, self._first_checksum_step = self._first_checksum_step, self.step + 1
        for number, (one, other) in enumerate(zip(expected, actual, strict=False)):
            if one != other:
                self._differ(first + number, "poses or velocities of bodies differ")
                return
        if len(expected) != len(actual):
            self._differ(self.step, "the number of steps differs")

    def _compare(self, recorded: str, text: str, actual: str | None = None) -> None:
        if (actual or self.world.state_hash()) != recorded:
            self._differ(self.step, text)

    def _differ(self, step: int, text: str) -> None:
        if self.difference is None:
            self.difference = Difference(step, text)


_CHANGES: Final[dict[str, Callable[..., object]]] = {
    "spawn_model": World.spawn_model,
    "move_model": World.move_model,
    "delete_model": World.delete_model,
    "randomize": World.randomize,
    "reset": World.reset,
    "set_appearance": World.set_appearance,
    "set_layer_map": lambda world, name, source: world.set_layer_map(name, source),
    "spawn_models": World.spawn_models,
    "move_models": World.move_models,
    "delete_models": World.delete_models,
    "call_plugin": World.call_plugin,
}


def _outcome(error: str | None) -> str:
    return "succeeds" if error is None else f"fails ({error})"
