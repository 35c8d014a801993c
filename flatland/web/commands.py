"""Carries out the messages of clients."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable, Hashable
from typing import TYPE_CHECKING, Any, Final

from flatland.errors import WorldError
from flatland.plugin_api.plugin import describe
from flatland.values import Twist
from flatland.web.feed import WorldFeed
from flatland.web.messages import Message
from flatland.web.model_files import check_file, model_files, preview
from flatland.web.numbers import series_of
from flatland.web.world_requests import between_steps

if TYPE_CHECKING:
    from flatland.web.client import Client

HOLD_TIMEOUT: Final = 5.0  # s of wall time after which a hold that is not repeated ends
DRIVE_TIMEOUT: Final = 0.5  # s of wall time after which a robot that is not commanded stops
_CHECK_PERIOD: Final = 0.1  # s between two searches for such holds and robots

_SUPERSEDED: Final = {"superseded": True}
_NAME: Final = re.compile(r"[A-Za-z0-9_./ ()+-]+")


class Commands:
    """Carries out messages; all methods are called in the thread of the loop."""

    def __init__(self) -> None:
        """Creates an object without holds and moving robots."""
        self._newest = _Newest()
        # Wall times at which holds end, by client, world and id of the model, and at which robots
        # stop, by client, world and topic.
        self._holds: dict[tuple[Client, WorldFeed, int], float] = {}
        self._drives: dict[tuple[Client, WorldFeed, str], float] = {}
        self._active = asyncio.Event()

    async def carry_out(self, client: Client, feed: WorldFeed, message: Message) -> Any:
        """Carries out a message for a world, and returns the result for the reply.

        Raises:
            FlatlandError: It cannot be carried out.
            ValueError: As above.
        """
        carry_out = _ACTIONS[message.type]
        return await carry_out(self, client, feed, message.fields)

    # -- time ------------------------------------------------------------------------------

    async def _pause(self, _client: Client, feed: WorldFeed, _fields: Any) -> None:
        def pause() -> None:
            feed.holds.keep_paused()
            feed.controller.pause()

        await between_steps(feed.world, pause)

    async def _resume(self, _client: Client, feed: WorldFeed, _fields: Any) -> None:
        await between_steps(feed.world, feed.controller.resume)

    async def _step(self, _client: Client, feed: WorldFeed, fields: Any) -> None:
        count = fields.get("n", 1)
        await feed.wait_for(feed.controller.step(count))

    async def _set_rate(self, _client: Client, feed: WorldFeed, fields: Any) -> None:
        await between_steps(feed.world, lambda: feed.controller.set_rate(fields["rate"]))

    # -- models ----------------------------------------------------------------------------

    async def _move(self, client: Client, feed: WorldFeed, fields: Any) -> Any:
        number, pose = fields["model"], fields["pose"]
        key = (client, feed, number)
        if key in self._holds:
            self._holds[key] = _now() + HOLD_TIMEOUT
        return await self._newest.run(
            ("move", *key),
            lambda: between_steps(
                feed.world, lambda: feed.controller.move(feed.find_model(number).name, pose)
            ),
        )

    async def _hold(self, client: Client, feed: WorldFeed, fields: Any) -> None:
        number = fields["model"]
        self._holds[client, feed, number] = _now() + HOLD_TIMEOUT
        self._active.set()

        def hold() -> None:
            feed.find_model(number)
            feed.holds.hold((client, number))

        await between_steps(feed.world, hold)

    async def _release(self, client: Client, feed: WorldFeed, fields: Any) -> None:
        number = fields["model"]
        await self._newest.idle(("move", client, feed, number))
        self._holds.pop((client, feed, number), None)
        await between_steps(feed.world, lambda: feed.holds.release((client, number)))

    async def _spawn(self, _client: Client, feed: WorldFeed, fields: Any) -> dict[str, str]:
        file, name, namespace = fields["file"], fields["name"], fields.get("namespace", "")
        if not _NAME.fullmatch(name):
            raise WorldError(
                f'the name "{name}" has a character other than letters, digits, _./()+-'
            )
        pose = fields["pose"]
        await between_steps(
            feed.world, lambda: feed.controller.spawn(check_file(file), name, namespace, pose)
        )
        return {"name": name}

    async def _preview(self, _client: Client, feed: WorldFeed, fields: Any) -> dict[str, Any]:
        return await asyncio.to_thread(preview, feed.world, fields["file"])

    async def _delete(self, _client: Client, feed: WorldFeed, fields: Any) -> None:
        number = fields["model"]
        await between_steps(
            feed.world, lambda: feed.controller.delete(feed.find_model(number).name)
        )

    async def _files(self, _client: Client, feed: WorldFeed, _fields: Any) -> list[dict[str, str]]:
        feed.state.model_files = await asyncio.to_thread(model_files, feed.world)
        return feed.state.model_files

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
            found = await between_steps(feed.world, drive)
            if moves and client.connected:
                self._drives[client, feed, found] = _now() + DRIVE_TIMEOUT
                self._active.set()
            else:
                self._drives.pop((client, feed, found), None)
                if moves:
                    feed.post(_stopping(feed, found))

        return await self._newest.run(("drive", client, feed, number, topic), run)

    # -- plots -----------------------------------------------------------------------------

    async def _describe_series(self, _client: Client, feed: WorldFeed, _fields: Any) -> list[str]:
        def describe_all() -> list[str]:
            outputs = feed.world.ports.outputs.values()
            return sorted(name for output in outputs for name in series_of(output))

        return await between_steps(feed.world, describe_all)

    # -- what ends by itself ---------------------------------------------------------------

    async def watch(self) -> None:
        """Ends holds that are not repeated, and stops robots that are not commanded any more."""
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
        """Ends the holds of a client that has disconnected, and stops its robots."""
        self._end(
            [key for key in self._holds if key[0] is client],
            [key for key in self._drives if key[0] is client],
        )

    def forget_world(self, feed: WorldFeed) -> None:
        """Ends the holds and stops the robots of a world that is not shown any more."""
        self._end(
            [key for key in self._holds if key[1] is feed],
            [key for key in self._drives if key[1] is feed],
        )

    def _end(
        self,
        holds: list[tuple[Client, WorldFeed, int]],
        drives: list[tuple[Client, WorldFeed, str]],
    ) -> None:
        for client, feed, number in holds:
            del self._holds[client, feed, number]
            feed.post(_releasing(feed, client, number))
        for client, feed, topic in drives:
            del self._drives[client, feed, topic]
            feed.post(_stopping(feed, topic))


class _Newest:
    """Runs one action of a key at a time; of those that wait, only the newest."""

    def __init__(self) -> None:
        self._running: set[Hashable] = set()
        self._waiting: dict[Hashable, asyncio.Future[bool]] = {}
        self._idle: dict[Hashable, list[asyncio.Future[None]]] = {}

    async def run(self, key: Hashable, action: Callable[[], Awaitable[Any]]) -> Any:
        """Returns the result of an action, or of a newer one of the same key instead."""
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
                following.set_result(True)  # `_running` keeps the key for it.
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
    """Returns the topic of a velocity command of a model; to be called between two steps.

    Raises:
        WorldError: The model has none, or not this one.
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


def _releasing(feed: WorldFeed, client: Client, number: int) -> Callable[[], None]:
    return lambda: feed.holds.release((client, number))


def _stopping(feed: WorldFeed, topic: str) -> Callable[[], None]:
    def stop() -> None:
        if topic in feed.world.ports.commands:
            feed.world.command(topic).set(Twist())

    return stop


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
    "drive": Commands._drive,
    "files": Commands._files,
    "describe_series": Commands._describe_series,
}
