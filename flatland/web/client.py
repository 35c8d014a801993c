"""One connection of a browser."""

from __future__ import annotations

import asyncio
import dataclasses
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final

from aiohttp import WSCloseCode, WSMsgType, web

from flatland.web.encoding import text_message
from flatland.web.feed import WorldFeed
from flatland.web.messages import Message, MessageError, parse
from flatland.web.views import Received, View

MAX_MESSAGES_PER_SECOND: Final = 120
_BURST: Final = 240  # messages
_MAX_TEXTS: Final = 1000  # replies and notices that wait to be sent


class Client:
    """One connection: what the client looks at, and what the client has received.

    Attributes:
        read_only: Whether the client cannot change a world.
        waiting: Number of requests of the client without a reply.
        connected: Whether the connection has not ended.
        notify: Makes the client send the messages that are new.
    """

    def __init__(
        self,
        socket: web.WebSocketResponse,
        feeds: Mapping[int, WorldFeed],
        *,
        read_only: bool,
    ) -> None:
        """Creates a client that looks at no world.

        Args:
            socket: The connection.
            feeds: The worlds by index; may change.
            read_only: Whether the client cannot change a world.
        """
        self.read_only = read_only
        self.waiting = 0
        self.connected = True
        self._socket = socket
        self._feeds = feeds
        self._view = View()
        self._close_code, self._close_reason = int(WSCloseCode.OK), b""
        self._worlds: tuple[int, ...] = ()  # requested indices, also of worlds that do not exist
        self._hidden = False
        self._received: dict[WorldFeed, Received] = {}
        self._texts: deque[str] = deque()
        self._new = asyncio.Event()
        self.notify = self._new.set
        self._tokens = float(_BURST)
        self._tokens_time = asyncio.get_running_loop().time()

    async def run(
        self, receive: Callable[[Client, Message], None], forget: Callable[[Client], None]
    ) -> None:
        """Serves the connection until it ends.

        Args:
            receive: Called with each message of the client.
            forget: Called when the client has disconnected.
        """
        writer = asyncio.create_task(self._write())
        try:
            async for message in self._socket:
                try:
                    if message.type is not WSMsgType.TEXT:
                        await self.end(WSCloseCode.UNSUPPORTED_DATA, "only text is accepted")
                        break
                    self._count_message()
                    receive(self, parse(message.data))
                except MessageError as error:
                    await self.end(WSCloseCode.POLICY_VIOLATION, str(error))
                    break
        finally:
            self.connected = False
            writer.cancel()
            for feed in self._received:
                feed.audience.remove(self.notify)
            forget(self)
        # If another task closes the connection, the loop above ends before the code is sent.
        await self._close()

    async def end(self, code: int, reason: str) -> None:
        """Closes the connection."""
        # The protocol limits a reason to 123 bytes.
        self._close_code, self._close_reason = code, reason.encode()[:120]
        await self._close()

    async def _close(self) -> None:
        await self._socket.close(code=self._close_code, message=self._close_reason)

    def _count_message(self) -> None:
        now = asyncio.get_running_loop().time()
        self._tokens += (now - self._tokens_time) * MAX_MESSAGES_PER_SECOND
        self._tokens = min(self._tokens, _BURST) - 1
        self._tokens_time = now
        if self._tokens < 0:
            raise MessageError(f"more than {MAX_MESSAGES_PER_SECOND} messages per second")

    # -- view ------------------------------------------------------------------------------

    def look(self, message: Message) -> None:
        """Changes what the client looks at; fields that are not given keep their value."""
        fields = message.fields
        self._worlds = fields.get("worlds", self._worlds)
        self._hidden = fields.get("hidden", self._hidden)
        names = (
            "scans",
            "compact_scans",
            "frames",
            "inspect",
            "series",
            "history",
            "topics",
            "topic_values",
        )
        view = {name: fields[name] for name in names if name in fields}
        if self.read_only:
            view["history"] = False  # Its snapshots are for those who can return to them.
        self._view = dataclasses.replace(self._view, **view)
        seen = View() if self._hidden else self._view
        for received in self._received.values():
            received.keep_topics(seen)
        self.update_feeds()

    def update_feeds(self) -> None:
        """Joins the audience of the requested worlds that exist, and leaves all others."""
        feeds = [self._feeds[n] for n in self._worlds if n in self._feeds]
        for feed in self._received:
            if feed not in feeds or self._hidden:
                feed.audience.remove(self.notify)
        self._received = {feed: self._received.get(feed, Received()) for feed in feeds}
        if not self._hidden:
            for feed in feeds:
                feed.audience.set_view(self.notify, self._view)
        self.notify()

    # -- messages to the client ------------------------------------------------------------

    def send(self, message: dict[str, Any]) -> None:
        """Sends a message that no other replaces, before the messages of worlds."""
        if len(self._texts) < _MAX_TEXTS:
            self._texts.append(text_message(message))
            self.notify()

    async def _write(self) -> None:
        try:
            while True:
                await self._new.wait()
                self._new.clear()
                while (message := self._next()) is not None:
                    if isinstance(message, str):
                        await self._socket.send_str(message)
                    else:
                        await self._socket.send_bytes(message)
        except ConnectionError:
            return  # `run` ends, too.

    def _next(self) -> str | bytes | None:
        if self._texts:
            return self._texts.popleft()
        if not self._hidden:
            for feed, received in self._received.items():
                message = feed.next_message(received, self._view)
                if message is not None:
                    return message
        return None
