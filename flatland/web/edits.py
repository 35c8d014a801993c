"""What a client has changed, and can undo and redo."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import Final

from flatland.geometry import Pose
from flatland.loading.model_source import ModelSpec
from flatland.web.controller import WorldController

MAX_EDITS: Final = 50


@dataclass(frozen=True, slots=True, eq=False)
class Edit:
    """A change of a world.

    Attributes:
        text: The change as a noun phrase, for users.
        undo: Reverses the change; called between two steps.
        redo: Repeats the change; called between two steps.
        file: Model file that `undo` or `redo` reads; empty for none.
        sets_back: Whether `undo` and `redo` change the time.
        key: Edits with the same key that follow each other are a single one; None for no key.
    """

    text: str
    undo: Callable[[], object]
    redo: Callable[[], object]
    file: str = ""
    sets_back: bool = False
    key: Hashable = None


class Edits:
    """The changes of a world by one client; those that were undone can be repeated."""

    def __init__(self) -> None:
        """Creates an object without changes."""
        self._done: list[Edit] = []
        self._undone: list[Edit] = []

    def add(self, edit: Edit) -> None:
        """Adds a change; those that were undone before cannot be repeated any more."""
        last = self._done[-1] if self._done else None
        if last is not None and edit.key is not None and last.key == edit.key:
            self._done.pop()
            edit = replace(edit, undo=last.undo)
        self._done.append(edit)
        del self._done[:-MAX_EDITS]
        self._undone.clear()

    def end_group(self) -> None:
        """Makes a later change with the key of the last one a change of its own."""
        if self._done:
            self._done[-1] = replace(self._done[-1], key=None)

    def last(self, *, undone: bool) -> Edit | None:
        """Returns the change to undo or to redo next, None if there is none.

        Args:
            undone: Whether to return a change that was undone.
        """
        edits = self._undone if undone else self._done
        return edits[-1] if edits else None

    def shift(self, edit: Edit) -> None:
        """Notes that a change was undone, or repeated if it was undone before."""
        if edit in self._done:
            self._done.remove(edit)
            self._undone.append(edit)
        elif edit in self._undone:
            self._undone.remove(edit)
            self._done.append(edit)


def spawn_of(spec: ModelSpec, controller: WorldController) -> Edit:
    """Returns the edit of a model that was spawned."""
    return Edit(
        f'the spawn of "{spec.name}"',
        undo=lambda: controller.delete(spec.name),
        redo=lambda: _spawn(spec, controller),
        file=spec.yaml_path,
    )


def deletion_of(spec: ModelSpec, controller: WorldController) -> Edit:
    """Returns the edit of a model that was deleted.

    Its undo spawns the model again: plugins start anew, and the bodies have the places relative to
    each other that the model file gives them. A snapshot could only restore the whole world.
    """
    return Edit(
        f'the deletion of "{spec.name}"',
        undo=lambda: _spawn(spec, controller),
        redo=lambda: controller.delete(spec.name),
        file=spec.yaml_path,
    )


def move_of(
    name: str, before: Pose, after: Pose, controller: WorldController, key: Hashable = None
) -> Edit:
    """Returns the edit of a model that was moved.

    Args:
        name: Name of the model.
        before: Its pose before the move, in the world frame [m, rad].
        after: Its pose after the move.
        controller: Moves it.
        key: Identifies the drag that the move is a part of; None if it is not a part of one.
    """
    return Edit(
        f'the move of "{name}"',
        undo=lambda: controller.move(name, before),
        redo=lambda: controller.move(name, after),
        key=key,
    )


def _spawn(spec: ModelSpec, controller: WorldController) -> None:
    x, y, theta = spec.pose
    controller.spawn(spec.yaml_path, spec.name, spec.namespace, (x, y, theta))
