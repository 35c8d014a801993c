"""Performs the requests of clients."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Hashable
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeVar

from flatland.errors import FlatlandError, WorldError
from flatland.loading.model_source import ModelSpec, spec_of
from flatland.loading.saved_world import SavedWorld
from flatland.plugin_api.plugin import describe
from flatland.runtime.file_reads import read_in_time_async
from flatland.values import Twist
from flatland.web.edits import Edit, deletion_of, move_of, spawn_of
from flatland.web.feed import WorldFeed
from flatland.web.messages import Message
from flatland.web.model_files import check_file, model_files, preview
from flatland.web.numbers import series_of
from flatland.web.state_commands import StateCommands

if TYPE_CHECKING:
    from flatland.web.client import Client

HOLD_TIMEOUT: Final = 5.0  # s of wall time after which a hold that is not repeated ends
DRIVE_TIMEOUT: Final = 0.5  # s of wall time after which a robot that is not commanded stops
_CHECK_PERIOD: Final = 0.1  # s between two searches for such holds and robots
READING_SHARE: Final = 0.05
"""Largest share of a processor that previews and lists of files of all clients use on average."""

T = TypeVar("T")

_SUPERSEDED: Final = {"superseded": True}

_Hold = tuple["Client", WorldFeed, int]  # the last part is the id of the model
_Drive = tuple["Client", WorldFeed, str]  # the last part is the topic


class Commands:
    """Performs the requests of clients; all methods are called in the thread of the loop."""

    def __init__(self) -> None:
        """Creates an object without holds and moving robots."""
        self._newest = _Newest()
        self._holds: dict[_Hold, float] = {}  # wall time at which each hold ends [s]
        self._drives: dict[_Drive, float] = {}  # wall time at which each robot stops [s]
        self._states = StateCommands()
        self._active = asyncio.Event()
        self._reading_due = 0.0  # wall time at which files may be read next for a preview [s]
        self._reading_period = 0.0  # time between two such reads [s]

    async def perform(self, client: Client, feed: WorldFeed, message: Message) -> Any:
        """Performs a request for a world, and returns the result for the reply.

        Raises:
            FlatlandError: The request cannot be performed.
            ValueError: An argument is invalid.
        """
        return await _ACTIONS[message.type](self, client, feed, message.fields)

    # -- time ------------------------------------------------------------------------------

    async def _pause(self, _client: Client, feed: WorldFeed, _fields: Any) -> None:
        def pause() -> None:
            feed.controller.holds.keep_paused()
            feed.controller.pause()

        await feed.requests.run(pause)

    async def _resume(self, _client: Client, feed: WorldFeed, _fields: Any) -> None:
        await feed.requests.run(feed.controller.resume)

    async def _step(self, _client: Client, feed: WorldFeed, fields: Any) -> None:
        await feed.requests.wait_for(feed.controller.step(fields.get("n", 1)))

    async def _set_rate(self, _client: Client, feed: WorldFeed, fields: Any) -> None:
        await feed.requests.run(lambda: feed.controller.set_rate(fields["rate"]))

    # -- models ----------------------------------------------------------------------------

    async def _move(self, client: Client, feed: WorldFeed, fields: Any) -> Any:
        number, pose = fields["model"], fields["pose"]
        hold = (client, feed, number)
        drag = number if hold in self._holds else None
        if drag is not None:
            self._holds[hold] = _now() + HOLD_TIMEOUT

        def move() -> tuple[Edit, dict[str, str]]:
            model = feed.find_model(number)
            name, before = model.name, model.pose
            feed.controller.move(name, pose)
            edit = move_of(name, before, pose, feed.controller, drag)
            return edit, {"overlap": feed.world.describe_overlap(name)}

        async def run() -> dict[str, str]:
            edit, result = await feed.requests.run(move)
            self._states.add(client, feed, edit)
            return result

        return await self._newest.run(("move", *hold), run)

    async def _hold(self, client: Client, feed: WorldFeed, fields: Any) -> None:
        number = fields["model"]
        if (client, feed, number) not in self._holds:
            self._states.begin_drag(client, feed)
        self._holds[client, feed, number] = _now() + HOLD_TIMEOUT
        self._active.set()

        def hold() -> None:
            feed.find_model(number)
            feed.controller.holds.hold((client, number))

        await feed.requests.run(hold)

    async def _release(self, client: Client, feed: WorldFeed, fields: Any) -> None:
        hold = (client, feed, fields["model"])
        await self._newest.idle(("move", *hold))
        self._holds.pop(hold, None)
        await feed.requests.run(partial(_release_model, *hold))

    async def _spawn(self, client: Client, feed: WorldFeed, fields: Any) -> dict[str, str]:
        file, name, namespace = fields["file"], fields["name"], fields.get("namespace", "")
        pose, source = fields["pose"], feed.world.source
        path = check_file(file)
        store = await read_in_time_async(lambda: source.read_models_ahead([path]))
        spawn = partial(feed.controller.spawn, path, name, namespace, pose)
        await feed.requests.run(source.inputs.using(store)(spawn))
        spec = ModelSpec(path, name, namespace, pose)
        self._states.add(client, feed, spawn_of(spec, feed.controller))
        return {"name": name}

    async def _preview(self, client: Client, feed: WorldFeed, fields: Any) -> dict[str, Any]:
        def read() -> dict[str, Any]:
            # An error of another file would tell whether it exists.
            if client.read_only and all(
                file["path"] != fields["file"] for file in model_files(feed.world)
            ):
                raise WorldError("a read-only viewer previews only the listed model files")
            return preview(feed.world, fields["file"])

        return await self._paced(read)

    async def _delete(self, client: Client, feed: WorldFeed, fields: Any) -> dict[str, bool]:
        number = fields["model"]

        def delete() -> ModelSpec | None:
            model = feed.find_model(number)
            spec = spec_of(model)
            feed.controller.delete(model.name)
            return spec

        spec = await feed.requests.run(delete)
        if spec is not None:
            self._states.add(client, feed, deletion_of(spec, feed.controller))
        return {"can_undo": spec is not None}

    async def _files(self, _client: Client, feed: WorldFeed, _fields: Any) -> list[dict[str, str]]:
        feed.contents.model_files = await self._paced(lambda: model_files(feed.world))
        return feed.contents.model_files

    async def _paced(self, read: Callable[[], T]) -> T:
        """Returns the result of a function that reads files, called in another thread.

        Calls wait so that all of them use `READING_SHARE` at most: parsing in another thread slows
        down the simulation as well.
        """

        def timed() -> T:
            start = time.thread_time()
            try:
                return read()
            finally:
                self._reading_period = (time.thread_time() - start) / READING_SHARE

        while (left := self._reading_due - _now()) > 0:
            await asyncio.sleep(left)
        self._reading_due = _now() + self._reading_period
        try:
            return await read_in_time_async(timed)
        finally:
            self._reading_due = max(self._reading_due, _now() + self._reading_period)

    # -- earlier states --------------------------------------------------------------------

    async def _undo(self, client: Client, feed: WorldFeed, _fields: Any) -> dict[str, str]:
        return await self._states.repeat(client, feed, undone=False)

    async def _redo(self, client: Client, feed: WorldFeed, _fields: Any) -> dict[str, str]:
        return await self._states.repeat(client, feed, undone=True)

    async def _reset(self, client: Client, feed: WorldFeed, _fields: Any) -> dict[str, bool | str]:
        return await self._states.reset(client, feed)

    async def _visit(self, _client: Client, feed: WorldFeed, fields: Any) -> Any:
        visit = partial(self._states.visit, feed, fields["moment"])
        return await self._newest.run(("visit", feed), visit)

    async def _save(self, _client: Client, feed: WorldFeed, _fields: Any) -> dict[str, Any]:
        saved = await feed.requests.run(lambda: SavedWorld(feed.world))
        text, notes = await self._paced(saved.file)
        return {"text": text, "name": saved.name, "folder": saved.folder, "notes": notes}

    # -- velocity commands -----------------------------------------------------------------

    async def _drive(self, client: Client, feed: WorldFeed, fields: Any) -> Any:
        number, topic = fields["model"], fields.get("command")
        moves = "linear" in fields or "angular" in fields
        vx, vy = fields.get("linear", (0.0, 0.0))
        twist = Twist(vx, vy, fields.get("angular", 0.0))

        def drive() -> str:
            found = _drive_topic(feed, number, topic)
            feed.world.command(found).set(twist)
            return found

        async def run() -> None:
            found = await feed.requests.run(drive)
            if moves and client.connected:
                self._drives[client, feed, found] = _now() + DRIVE_TIMEOUT
                self._active.set()
            else:
                self._drives.pop((client, feed, found), None)
                if moves:
                    feed.requests.post(partial(_stop_robot, feed, found))

        return await self._newest.run(("drive", client, feed, number, topic), run)

    # -- plots -----------------------------------------------------------------------------

    async def _describe_series(self, _client: Client, feed: WorldFeed, _fields: Any) -> list[str]:
        def describe_all() -> list[str]:
            outputs = feed.world.ports.outputs.values()
            return sorted(name for output in outputs for name in series_of(output))

        return await feed.requests.run(describe_all)

    # -- topics of other programs ----------------------------------------------------------

    async def _publish_pose(self, _client: Client, feed: WorldFeed, fields: Any) -> dict[str, bool]:
        topics = feed.foreign_topics
        if topics is None:
            raise FlatlandError("this program is not connected to other programs")
        kind, topic, pose = fields["purpose"], fields["topic"], fields["pose"]

        async def publish() -> dict[str, bool]:
            return {"received": await asyncio.to_thread(topics.publish_pose, kind, topic, pose)}

        # One of each kind at a time, so that clients occupy few threads.
        return await self._newest.run(("publish_pose", feed, kind), publish)  # type: ignore[no-any-return]

    # -- holds and robots without further requests -----------------------------------------

    async def watch(self) -> None:
        """Ends holds and stops robots after their timeouts; runs until it is cancelled."""
        while True:
            await self._active.wait()
            await asyncio.sleep(_CHECK_PERIOD)
            now = _now()
            self._end(
                [key for key, end in self._holds.items() if end < now],
                [key for key, end in self._drives.items() if end < now],
            )
            if not self._holds and not self._drives:
                self._active.clear()

    def forget(self, client: Client) -> None:
        """Ends the holds and stops the robots of a client that has disconnected."""
        self._states.forget(client)
        self._end(
            [key for key in self._holds if key[0] is client],
            [key for key in self._drives if key[0] is client],
        )

    def forget_world(self, feed: WorldFeed) -> None:
        """Ends the holds and stops the robots of a world that was removed from the server."""
        self._states.forget_world(feed)
        self._end(
            [key for key in self._holds if key[1] is feed],
            [key for key in self._drives if key[1] is feed],
        )

    def _end(self, holds: list[_Hold], drives: list[_Drive]) -> None:
        for hold in holds:
            del self._holds[hold]
            hold[1].requests.post(partial(_release_model, *hold))
        for drive in drives:
            del self._drives[drive]
            _, feed, topic = drive
            feed.requests.post(partial(_stop_robot, feed, topic))


class _Newest:
    """Performs one action of a key at a time; of the actions that wait, only the newest."""

    def __init__(self) -> None:
        self._running: set[Hashable] = set()
        self._waiting: dict[Hashable, asyncio.Future[bool]] = {}
        self._idle: dict[Hashable, list[asyncio.Future[None]]] = {}

    async def run(self, key: Hashable, action: Callable[[], Awaitable[Any]]) -> Any:
        """Returns the result of an action, or `_SUPERSEDED` if a newer one of the key replaced it.

        Args:
            key: Identifies actions that replace each other.
            action: The action.
        """
        if key in self._running:
            former = self._waiting.pop(key, None)
            if former is not None and not former.done():
                former.set_result(False)
            turn = asyncio.get_running_loop().create_future()
            self._waiting[key] = turn
            if not await turn:
                return _SUPERSEDED
        self._running.add(key)
        try:
            return await action()
        finally:
            following = self._waiting.pop(key, None)
            if following is not None and not following.done():
                following.set_result(True)  # The key remains in `_running` for this action.
            else:
                self._running.discard(key)
                for waiter in self._idle.pop(key, []):
                    if not waiter.done():
                        waiter.set_result(None)

    async def idle(self, key: Hashable) -> None:
        """Waits until no action of a key runs or waits."""
        while key in self._running:
            waiter = asyncio.get_running_loop().create_future()
            self._idle.setdefault(key, []).append(waiter)
            await waiter


def _drive_topic(feed: WorldFeed, number: int, topic: str | None) -> str:
    """Returns the topic of a velocity command of a model; must be called between two steps.

    Raises:
        WorldError: The model has no velocity command, or none with this topic.
    """
    model = feed.find_model(number)
    ports = feed.world.ports
    topics = [
        command.topic
        for plugin in model.plugins
        for command in ports.commands_of(describe(plugin))
        if command.value_type is Twist
    ]
    if not topics or topic not in (None, *topics):
        asked = "no velocity command" if topic is None else f'no velocity command "{topic}"'
        raise WorldError(f'model "{model.name}" has {asked}; it has: {", ".join(topics) or "none"}')
    return topics[0] if topic is None else topic


def _release_model(client: Client, feed: WorldFeed, number: int) -> None:
    feed.controller.holds.release((client, number))


def _stop_robot(feed: WorldFeed, topic: str) -> None:
    if topic in feed.world.ports.commands:
        feed.world.command(topic).set(Twist())


def _now() -> float:
    return asyncio.get_running_loop().time()


_ACTIONS: Final[dict[str, Callable[..., Awaitable[Any]]]] = {
    "pause": Commands._pause,
    "resume": Commands._resume,
    "step": Commands._step,
    "set_rate": Commands._set_rate,
    "move": Commands._move,
    "hold": Commands._hold,
    "release": Commands._release,
    "spawn": Commands._spawn,
    "preview": Commands._preview,
    "delete": Commands._delete,
    "reset": Commands._reset,
    "visit": Commands._visit,
    "save": Commands._save,
    "undo": Commands._undo,
    "redo": Commands._redo,
    "drive": Commands._drive,
    "files": Commands._files,
    "describe_series": Commands._describe_series,
    "publish_pose": Commands._publish_pose,
}
