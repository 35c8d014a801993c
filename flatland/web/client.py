"""One connection of a browser."""

from __future__ import annotations

import asyncio
import dataclasses
from collections import deque
from typing import TYPE_CHECKING, Any, Final

from aiohttp import WSCloseCode, WSMsgType, web

from flatland.web.client_view import Seen, View
from flatland.web.encoding import text_message
from flatland.web.feed import WorldFeed
from flatland.web.messages import Message, MessageError, parse

if TYPE_CHECKING:
    from flatland.web.hub import Hub

MAX_MESSAGES_PER_SECOND: Final = 120
_BURST: Final = 240  # messages
_MAX_TEXTS: Final = 1000  # replies and notices that wait to be sent


class Client:
    """One connection: what it looks at, and what it has received.

    Attributes:
        view: What it looks at.
        waiting: Number of its requests that are not answered.
        connected: Whether the connection has not ended.
    """

    def __init__(self, socket: web.WebSocketResponse, hub: Hub) -> None:
        """Creates a client that looks at nothing yet.

        Args:
            socket: The connection.
            hub: The worlds.
        """
        self.view = View()
        self.waiting = 0
        self.connected = True
        self._socket = socket
        self._hub = hub
        self._end = (int(WSCloseCode.OK), b"")
        self._wish: tuple[int, ...] = ()
        self._hidden = False
        self._seen: dict[WorldFeed, Seen] = {}
        self._texts: deque[str] = deque()
        self._wake = asyncio.Event()
        self.wake = self._wake.set
        self._tokens = float(_BURST)
        self._tokens_time = asyncio.get_running_loop().time()

    async def run(self) -> None:
        """Serves the connection until it ends."""
        writer = asyncio.create_task(self._write())
        try:
            async for message in self._socket:
                try:
                    if message.type is not WSMsgType.TEXT:
                        await self.end(WSCloseCode.UNSUPPORTED_DATA, "only text is accepted")
                        break
                    self._count_message()
                    self._hub.receive(self, parse(message.data))
                except MessageError as error:
                    await self.end(WSCloseCode.POLICY_VIOLATION, str(error))
                    break
        finally:
            self.connected = False
            writer.cancel()
            self._hub.forget(self)
        # If another task closes the connection, the loop above ends before it has sent the code.
        await self._close()

    async def end(self, code: int, reason: str) -> None:
        """Closes the connection."""
        # A reason has at most 123 bytes.
        self._end = code, reason.encode()[:120]
        await self._close()

    async def _close(self) -> None:
        code, reason = self._end
        await self._socket.close(code=code, message=reason)

    def _count_message(self) -> None:
        now = asyncio.get_running_loop().time()
        self._tokens += (now - self._tokens_time) * MAX_MESSAGES_PER_SECOND
        self._tokens = min(self._tokens, _BURST) - 1
        self._tokens_time = now
        if self._tokens < 0:
            raise MessageError(f"more than {MAX_MESSAGES_PER_SECOND} messages per second")

    # -- what it looks at ------------------------------------------------------------------

    def look(self, message: Message) -> None:
        """Changes what the client looks at; fields that are not given keep their value."""
        fields = message.fields
        self._wish = fields.get("worlds", self._wish)
        self._hidden = fields.get("hidden", self._hidden)
        names = ("scans", "frames", "inspect", "series")
        self.view = dataclasses.replace(
            self.view, **{name: fields[name] for name in names if name in fields}
        )
        self.update_feeds()

    def update_feeds(self) -> None:
        """Looks at the worlds that the client wants and that exist."""
        feeds = [self._hub.feeds[n] for n in self._wish if n in self._hub.feeds]
        for feed in self._seen:
            if feed not in feeds or self._hidden:
                feed.look_away(self.wake)
        self._seen = {feed: self._seen.get(feed, Seen()) for feed in feeds}
        if not self._hidden:
            for feed in feeds:
                feed.look(self.wake, self.view)
        self.wake()

    # -- what it receives ------------------------------------------------------------------

    def send(self, message: dict[str, Any]) -> None:
        """Sends a message that must not be left out, before those of worlds."""
        if len(self._texts) < _MAX_TEXTS:
            self._texts.append(text_message(message))
            self.wake()

    async def _write(self) -> None:
        try:
            while True:
                await self._wake.wait()
                self._wake.clear()
                while (message := self._next()) is not None:
                    if isinstance(message, str):
                        await self._socket.send_str(message)
                    else:
                        await self._socket.send_bytes(message)
        except ConnectionError:
            return  # The reader ends too.

    def _next(self) -> str | bytes | None:
        if self._texts:
            return self._texts.popleft()
        if not self._hidden:
            for feed, seen in self._seen.items():
                message = feed.next_message(seen, self.view)
                if message is not None:
                    return message
        return None
