"""The worlds and the clients of a server, in the thread of its loop."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Coroutine
from typing import Any, Final

from flatland.errors import PLUGIN_FAULTS, FlatlandError
from flatland.web.client import MAX_MESSAGES_PER_SECOND, Client
from flatland.web.commands import Commands
from flatland.web.controller import WorldController
from flatland.web.feed import WorldFeed
from flatland.web.messages import MAX_SIZE, READ_ONLY_TYPES, Message
from flatland.web.model_files import model_files
from flatland.web.scene import LayerContents
from flatland.world import World

_LOG = logging.getLogger("flatland")

PROTOCOL_VERSION: Final = 1
MAX_WAITING: Final = 64  # requests of a client that wait for the simulator


class Hub:
    """Connects clients with worlds; all methods are called in the thread of the loop.

    Attributes:
        feeds: The worlds by index.
        clients: The connections.
    """

    def __init__(self, title: str, read_only: bool) -> None:
        """Creates a hub without worlds.

        Args:
            title: Title of the page.
            read_only: Whether clients may only look.
        """
        self.feeds: dict[int, WorldFeed] = {}
        self.clients: set[Client] = set()
        self.read_only = read_only
        self._title = title
        self._ids = itertools.count(1)
        self._tasks: dict[WorldFeed, asyncio.Task[None]] = {}
        self._jobs: set[asyncio.Task[None]] = set()
        self._commands = Commands()

    # -- worlds ----------------------------------------------------------------------------

    def add(self, index: int, name: str, world: World, controller: WorldController) -> WorldFeed:
        """Adds a world."""
        feed = WorldFeed(index, name, world, controller, self._ids)
        self.feeds[index] = feed
        self._tasks[feed] = asyncio.create_task(self._run(feed))
        for client in self.clients:
            client.send(self.hello())
            client.update_feeds()
        return feed

    async def _run(self, feed: WorldFeed) -> None:
        try:
            feed.state.model_files = await asyncio.to_thread(model_files, feed.world)
            await feed.run()
        except asyncio.CancelledError:
            raise
        except Exception:
            _LOG.exception("unexpected internal error in the web viewer")
        self.remove(feed.index)

    def remove(self, index: int) -> None:
        """Removes a world, if it is there."""
        feed = self.feeds.pop(index, None)
        if feed is None:
            return
        task = self._tasks.pop(feed)
        if task is not asyncio.current_task():
            task.cancel()
        self._commands.forget_world(feed)
        for client in self.clients:
            client.update_feeds()
            client.send({"type": "gone", "world": index})

    def layers_changed(self, index: int) -> None:
        """Has the layers of a world copied again."""
        if index in self.feeds:
            self.feeds[index].layers_changed()

    def draw(self, index: int, lines: LayerContents) -> None:
        """Shows lines in addition to the layers of a world."""
        if index in self.feeds:
            self.feeds[index].draw(lines)

    # -- clients ---------------------------------------------------------------------------

    def hello(self) -> dict[str, Any]:
        """Returns the first message of a connection; sent again when a world is added."""
        return {
            "type": "hello",
            "version": PROTOCOL_VERSION,
            "title": self._title,
            "read_only": self.read_only,
            "worlds": [{"world": n, "name": feed.name} for n, feed in sorted(self.feeds.items())],
            "limits": {"message_size": MAX_SIZE, "messages_per_second": MAX_MESSAGES_PER_SECOND},
        }

    async def serve(self, client: Client) -> None:
        """Serves a connection until it ends."""
        self.clients.add(client)
        client.send(self.hello())
        await client.run()

    def forget(self, client: Client) -> None:
        """Ends everything that a client has begun."""
        self.clients.discard(client)
        self._commands.forget(client)
        for feed in self.feeds.values():
            feed.look_away(client.wake)

    def receive(self, client: Client, message: Message) -> None:
        """Carries out a message of a client and replies to it."""
        self._start(self._carry_out(client, message))

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._jobs.add(task)
        task.add_done_callback(self._jobs.discard)

    async def watch(self) -> None:
        """Ends what clients have begun and do not continue; runs until it is cancelled."""
        await self._commands.watch()

    async def _carry_out(self, client: Client, message: Message) -> None:
        client.waiting += 1
        try:
            if client.waiting > MAX_WAITING:
                raise FlatlandError("too many requests wait for the simulator")
            if self.read_only and message.type not in READ_ONLY_TYPES:
                raise FlatlandError("this viewer is read-only")
            result = await self._result(client, message)
            client.send({"type": "reply", "id": message.id, "ok": True, "result": result})
        except (FlatlandError, ValueError) as error:
            client.send({"type": "reply", "id": message.id, "ok": False, "error": str(error)})
        except PLUGIN_FAULTS as error:
            _LOG.exception("web viewer: %s failed", message.type)
            client.send({"type": "reply", "id": message.id, "ok": False, "error": repr(error)})
        finally:
            client.waiting -= 1

    async def _result(self, client: Client, message: Message) -> object:
        if message.type == "look":
            client.look(message)
            return None
        feed = self.feeds.get(message.world)
        if feed is None:
            raise FlatlandError(f"there is no world {message.world}")
        return await self._commands.carry_out(client, feed, message)

    async def disconnect(self, code: int, reason: str) -> None:
        """Closes all connections."""
        await asyncio.gather(
            *(client.end(code, reason) for client in self.clients), return_exceptions=True
        )

    async def close(self) -> None:
        """Ends all tasks."""
        tasks = [*self._tasks.values(), *self._jobs]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
