"""Performs the requests of clients to undo changes and to return to earlier states."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.errors import FlatlandError, WorldError
from flatland.runtime.file_reads import read_in_time_async
from flatland.web.edits import Edit, Edits
from flatland.web.feed import WorldFeed

if TYPE_CHECKING:
    from flatland.web.client import Client


class StateCommands:
    """The changes of all clients, and returns to earlier states; used in the thread of the loop."""

    def __init__(self) -> None:
        """Creates an object without changes."""
        self._edits: dict[tuple[Client, WorldFeed], Edits] = {}

    def add(self, client: Client, feed: WorldFeed, edit: Edit) -> None:
        """Adds a change of a world by a client."""
        if client.connected:
            self._edits.setdefault((client, feed), Edits()).add(edit)

    def begin_drag(self, client: Client, feed: WorldFeed) -> None:
        """Makes further moves a change of their own."""
        if (client, feed) in self._edits:
            self._edits[client, feed].end_group()

    async def repeat(self, client: Client, feed: WorldFeed, *, undone: bool) -> dict[str, str]:
        """Undoes the last change of a client, or repeats it, and returns the result for the reply.

        Args:
            client: The client.
            feed: The world.
            undone: Whether to repeat the last change that was undone.

        Raises:
            FlatlandError: There is no such change, or it cannot be undone or repeated now.
        """
        edits = self._edits.get((client, feed), Edits())
        edit = edits.last(undone=undone)
        if edit is None:
            raise FlatlandError(f"there is nothing to {'redo' if undone else 'undo'}")
        action, source = edit.redo if undone else edit.undo, feed.world.source
        paths = [edit.file] if edit.file else []
        # Taken at once, so that a second request does not repeat the same change.
        edits.shift(edit)
        try:
            store = await read_in_time_async(lambda: source.read_models_ahead(paths))
            await feed.requests.run(source.inputs.using(store)(action))
        except BaseException:
            edits.shift(edit)
            raise
        effect = feed.controller.set_back_effect if edit.sets_back else ""
        return {"text": edit.text, "effect": effect}

    async def reset(self, client: Client, feed: WorldFeed) -> dict[str, bool | str]:
        """Resets a world, and returns the result for the reply.

        Raises:
            FlatlandError: The world cannot be reset.
        """
        number = await feed.requests.run(lambda: _reset(feed))
        self.forget_world(feed)  # The models of earlier changes may not exist any more.
        if number is not None:
            self.add(client, feed, _reset_of(feed, number))
        return {"can_undo": number is not None, "effect": feed.controller.set_back_effect}

    async def visit(self, feed: WorldFeed, moment: int) -> dict[str, str]:
        """Pauses a world at an earlier state, and returns the result for the reply.

        Args:
            feed: The world.
            moment: Number of the moment in the history of the world.

        Raises:
            FlatlandError: The state is not kept any more, or cannot be restored.
        """
        controller = feed.controller

        def visit() -> None:
            feed.history.visit(moment, controller.restore)
            controller.holds.keep_paused()
            controller.pause()

        await feed.requests.run(visit)
        self.forget_world(feed)  # Earlier changes belong to another state.
        return {"effect": controller.set_back_effect}

    def forget(self, client: Client) -> None:
        """Forgets the changes of a client that has disconnected."""
        self._edits = {key: edits for key, edits in self._edits.items() if key[0] is not client}

    def forget_world(self, feed: WorldFeed) -> None:
        """Forgets the changes of a world by all clients."""
        self._edits = {key: edits for key, edits in self._edits.items() if key[1] is not feed}


def _reset(feed: WorldFeed) -> int | None:
    """Resets a world, and returns the number of the moment before; None if it cannot be saved."""
    try:
        number = feed.history.mark("before the reset")
    except WorldError:
        number = None  # A plugin cannot be copied.
    feed.controller.reset()
    return number


def _reset_of(feed: WorldFeed, number: int) -> Edit:
    """Returns the edit of a reset; each repetition saves the state before anew."""
    before: int | None = number

    def undo() -> None:
        if before is None:
            raise WorldError("the state before the reset cannot be saved")
        feed.history.restore(before, feed.controller.restore)

    def redo() -> None:
        nonlocal before
        before = _reset(feed)

    return Edit("the reset of the world", undo, redo, sets_back=True)
