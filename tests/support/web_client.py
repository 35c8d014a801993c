"""A client of the viewer in the browser: what the page receives and sends, without a browser."""

from __future__ import annotations

import asyncio
import itertools
import json
import struct
import time
from collections.abc import Callable
from typing import Any

import aiohttp
import pytest
from waiting import TIMEOUT

_HEADER = struct.Struct("<BBHId")
EDGES, POSES, SAME_BODIES = 1, 2, 4  # kinds of binary messages


class WebClient:
    """A connection to a viewer; messages are read while a method waits.

    Attributes:
        hello: The last message `hello`.
        worlds: For each world the last messages `world` and `status`, all models by name, the
            poses of all bodies by id, and the edges of all layers by number.
        texts: All other messages.
    """

    def __init__(self, url: str, **look: Any) -> None:
        """Connects to the viewer with an address, and looks at all of its worlds.

        Args:
            url: Address of the page.
            look: More fields of the message `look`.
        """
        self.hello: dict[str, Any] = {}
        self.worlds: dict[int, dict[str, Any]] = {}
        self.texts: list[dict[str, Any]] = []
        self._ids = itertools.count(1)
        self._replies: dict[int, dict[str, Any]] = {}
        self._loop = asyncio.new_event_loop()
        page, _, query = url.partition("?")
        try:
            self._session, self._socket = self._loop.run_until_complete(
                self._connect(f"{page.replace('http', 'ws', 1)}ws?{query}")
            )
        except BaseException:
            self._loop.close()
            raise
        try:
            self.until("hello", lambda: self.hello)
            self.look(worlds=[world["world"] for world in self.hello["worlds"]], **look)
        except BaseException:
            self.close()
            raise

    @staticmethod
    async def _connect(url: str) -> tuple[Any, Any]:
        session = aiohttp.ClientSession()
        try:
            return session, await session.ws_connect(url, protocols=["flatland.1"])
        except BaseException:
            await session.close()
            raise

    def __enter__(self) -> WebClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection."""

        async def end() -> None:
            await self._socket.close()
            await self._session.close()

        if not self._loop.is_closed():
            self._loop.run_until_complete(end())
            self._loop.close()

    def look(self, **fields: Any) -> None:
        """Changes what is received."""
        assert self.send("look", **fields)["ok"]

    def send(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Sends a message and returns its reply."""
        number = next(self._ids)
        message = {"id": number, "type": kind, **fields}
        self._loop.run_until_complete(self._socket.send_json(message))
        self.until(f"reply to {kind}", lambda: number in self._replies)
        return self._replies.pop(number)

    def do(self, kind: str, **fields: Any) -> Any:
        """Sends a message that succeeds, and returns its result."""
        reply = self.send(kind, **fields)
        assert reply["ok"], reply
        return reply["result"]

    def refused(self, kind: str, **fields: Any) -> str:
        """Sends a message that fails, and returns the error."""
        reply = self.send(kind, **fields)
        assert not reply["ok"], reply
        return str(reply["error"])

    def until(self, what: str, condition: Callable[[], Any]) -> Any:
        """Reads messages until a condition holds, and returns its value."""
        end = time.monotonic() + TIMEOUT
        while not (result := condition()):
            left = end - time.monotonic()
            if left <= 0:
                pytest.fail(f"{what}: not within {TIMEOUT} s; {self.worlds}")
            self._receive(left)
        return result

    # -- the state of a world --------------------------------------------------------------

    def status(self, world: int = 0) -> dict[str, Any]:
        """Returns the last status of a world, and waits for the first one."""
        return dict(self.until("status", lambda: self.worlds.get(world, {}).get("status")))

    def until_status(self, world: int = 0, **expected: Any) -> dict[str, Any]:
        """Waits until fields of the status of a world have these values."""
        self.until(
            f"status {expected}",
            lambda: {k: self.status(world).get(k) for k in expected} == expected,
        )
        return self.status(world)

    def model(self, name: str, world: int = 0) -> dict[str, Any]:
        """Waits for a model, and returns its description."""
        found = self.until(
            f"model {name}", lambda: self.worlds.get(world, {}).get("models", {}).get(name)
        )
        return dict(found)

    def pose(self, name: str, world: int = 0) -> tuple[float, float, float]:
        """Returns the last pose of the first body of a model, and waits for the first one."""
        body = self.model(name, world)["bodies"][0]["id"]
        x, y, theta = self.until("pose", lambda: self.worlds[world]["poses"].get(body))
        return x, y, theta

    # -- messages --------------------------------------------------------------------------

    def _receive(self, timeout: float) -> None:
        message = self._loop.run_until_complete(self._socket.receive(timeout))
        if message.type is aiohttp.WSMsgType.TEXT:
            self._take_text(json.loads(message.data))
        elif message.type is aiohttp.WSMsgType.BINARY:
            self._take_binary(message.data)
        else:
            raise ConnectionError(f"{message.type!r}: {message.data}, {message.extra}")

    def _take_text(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        if kind == "hello":
            self.hello = message
        elif kind == "reply":
            self._replies[message["id"]] = message
        elif kind in ("world", "status"):
            self._world(message["world"])[kind] = message
        elif kind == "models":
            models = self._world(message["world"])["models"]
            changed = {model["id"] for model in message["models"]} | set(message["removed"])
            for name in [name for name, model in models.items() if model["id"] in changed]:
                del models[name]
            if message["complete"]:
                models.clear()
            models.update({model["name"]: model for model in message["models"]})
        elif kind == "gone":
            self.worlds.pop(message["world"], None)
        else:
            self.texts.append(message)

    def _take_binary(self, data: bytes) -> None:
        kind, _version, world, _revision, _time = _HEADER.unpack_from(data)
        if kind == EDGES:
            layer, count = struct.unpack_from("<II", data, _HEADER.size)
            numbers = struct.unpack_from(f"<{4 * count}f", data, _HEADER.size + 8)
            self._world(world)["edges"][layer] = list(zip(*[iter(numbers)] * 4, strict=True))
        elif kind in (POSES, SAME_BODIES):
            state, offset = self._world(world), _HEADER.size + 4
            (count,) = struct.unpack_from("<I", data, _HEADER.size)
            if kind == POSES:
                state["bodies"] = struct.unpack_from(f"<{count}I", data, offset)
                offset += 4 * count
            numbers = struct.unpack_from(f"<{3 * count}f", data, offset)
            poses = zip(*[iter(numbers)] * 3, strict=True)
            state["poses"].update(zip(state["bodies"], poses, strict=True))

    def _world(self, number: int) -> dict[str, Any]:
        return self.worlds.setdefault(
            number, {"models": {}, "poses": {}, "bodies": (), "edges": {}}
        )
