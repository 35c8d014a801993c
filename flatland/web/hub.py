"""The worlds and the clients of a server, in the thread of its loop."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress
from typing import Any, Final

from flatland.errors import PLUGIN_FAULTS, FlatlandError, WorldError
from flatland.runtime.file_reads import read_in_time_async
from flatland.web.client import MAX_MESSAGES_PER_SECOND, Client
from flatland.web.commands import Commands
from flatland.web.encoding import VERSION
from flatland.web.feed import WorldFeed
from flatland.web.messages import MAX_SIZE, READ_ONLY_TYPES, Message
from flatland.web.model_files import model_files

_LOG = logging.getLogger("flatland")

MAX_WAITING: Final = 64  # requests of a client without a reply


class Hub:
    """Connects clients with worlds; all methods are called in the thread of the loop.

    Attributes:
        feeds: The worlds by index.
        clients: The connections.
        commands: Performs the requests of clients.
    """

    def __init__(self, title: str) -> None:
        """Creates a hub without worlds.

        Args:
            title: Title of the page.
        """
        self.feeds: dict[int, WorldFeed] = {}
        self.clients: set[Client] = set()
        self.commands = Commands()
        self._title = title
        self._tasks: dict[WorldFeed, asyncio.Task[None]] = {}
        self._jobs: set[asyncio.Task[None]] = set()

    # -- worlds ----------------------------------------------------------------------------

    def add(self, feed: WorldFeed) -> None:
        """Adds a world and starts to capture it."""
        self.feeds[feed.index] = feed
        self._tasks[feed] = asyncio.create_task(self._run(feed))
        for client in self.clients:
            client.send(self._hello(client))
            client.update_feeds()

    async def _run(self, feed: WorldFeed) -> None:
        try:
            with suppress(WorldError):  # The page requests the list again.
                feed.contents.model_files = await read_in_time_async(
                    lambda: model_files(feed.world)
                )
            await feed.run()
        except asyncio.CancelledError:
            raise
        except Exception:
            _LOG.exception("unexpected internal error in the web viewer")
        self.remove(feed)

    def remove(self, feed: WorldFeed) -> None:
        """Removes a world; further calls have no effect."""
        task = self._tasks.pop(feed, None)
        if task is None:
            return
        del self.feeds[feed.index]
        if task is not asyncio.current_task():
            task.cancel()
        self.commands.forget_world(feed)
        for client in self.clients:
            client.update_feeds()
            client.send({"type": "gone", "world": feed.index})

    # -- clients ---------------------------------------------------------------------------

    def _hello(self, client: Client) -> dict[str, Any]:
        """Returns the first message of a connection; sent again when a world is added."""
        return {
            "type": "hello",
            "version": VERSION,
            "title": self._title,
            "read_only": client.read_only,
            "worlds": [{"world": n, "name": feed.name} for n, feed in sorted(self.feeds.items())],
            "limits": {"message_size": MAX_SIZE, "messages_per_second": MAX_MESSAGES_PER_SECOND},
        }

    async def serve(self, client: Client) -> None:
        """Serves a connection until it ends."""
        self.clients.add(client)
        client.send(self._hello(client))
        await client.run(self.receive, self.forget)

    def forget(self, client: Client) -> None:
        """Removes a client that has disconnected, with its holds and moving robots."""
        self.clients.discard(client)
        self.commands.forget(client)

    def receive(self, client: Client, message: Message) -> None:
        """Starts to perform a request of a client; a reply follows."""
        task = asyncio.create_task(self._reply(client, message))
        self._jobs.add(task)
        task.add_done_callback(self._jobs.discard)

    async def _reply(self, client: Client, message: Message) -> None:
        client.waiting += 1
        try:
            reply: dict[str, Any] = {"ok": True, "result": await self._perform(client, message)}
        except (FlatlandError, ValueError) as error:
            reply = {"ok": False, "error": str(error)}
        except PLUGIN_FAULTS as error:
            _LOG.exception("web viewer: %s failed", message.type)
            reply = {"ok": False, "error": repr(error)}
        finally:
            client.waiting -= 1
        client.send({"type": "reply", "id": message.id, **reply})

    async def _perform(self, client: Client, message: Message) -> object:
        """Performs a request of a client and returns the result.

        Raises:
            FlatlandError: The request is not accepted or cannot be performed.
            ValueError: An argument is invalid.
        """
        if client.waiting > MAX_WAITING:
            raise FlatlandError("too many requests wait for the simulator")
        if client.read_only and message.type not in READ_ONLY_TYPES:
            raise FlatlandError("this viewer is read-only")
        if message.type == "look":
            client.look(message)
            return None
        feed = self.feeds.get(message.world)
        if feed is None:
            raise FlatlandError(f"there is no world {message.world}")
        return await self.commands.perform(client, feed, message)

    async def disconnect(self, code: int, reason: str) -> None:
        """Closes all connections."""
        await asyncio.gather(
            *(client.end(code, reason) for client in self.clients), return_exceptions=True
        )

    async def close(self) -> None:
        """Cancels all tasks and waits until they have ended."""
        tasks: list[asyncio.Task[Any]] = [*self._tasks.values(), *self._jobs]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
