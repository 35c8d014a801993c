"""A client of the viewer in the browser that keeps each message as it arrived."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import json
import math
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import aiohttp
import numpy as np
from waiting import TIMEOUT

HEADER = struct.Struct("<BBHId")


@dataclass(frozen=True)
class Binary:
    """A decoded binary message; poses of the same bodies as before have kind 2 and no ids."""

    kind: int
    version: int
    world: int
    revision: int
    time: float
    payload: bytes
    bodies: list[int] | None = None  # of poses without ids

    def edges(self) -> tuple[int, np.ndarray]:
        layer, count = struct.unpack_from("<II", self.payload)
        assert len(self.payload) == 8 + 16 * count
        return layer, np.frombuffer(self.payload, "<f4", offset=8).reshape(count, 4)

    def poses(self) -> dict[int, np.ndarray]:
        (count,) = struct.unpack_from("<I", self.payload)
        ids = np.frombuffer(self.payload, "<u4", count, 4).tolist() if self.bodies is None else []
        poses = np.frombuffer(self.payload, "<f4", offset=4 + 4 * len(ids)).reshape(-1, 3)
        assert len(poses) == count
        return dict(zip(self.bodies or ids, poses, strict=True))

    def scans(self) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        (groups,) = struct.unpack_from("<I", self.payload)
        found, offset = {}, 4
        for _ in range(groups):
            count, beams = struct.unpack_from("<II", self.payload, offset)
            offset += 8
            bits = 32
            if self.kind == 5:
                (bits,) = struct.unpack_from("<I", self.payload, offset)
                offset += 4
            ids = np.frombuffer(self.payload, "<u4", count, offset).tolist()
            offset += 4 * count
            poses = np.frombuffer(self.payload, "<f4", 3 * count, offset).reshape(count, 3)
            offset += 12 * count
            if bits == 16:
                resolutions = np.frombuffer(self.payload, "<f4", count, offset)
                offset += 4 * count
                codes = np.frombuffer(self.payload, "<u2", count * beams, offset)
                ranges = codes * np.repeat(resolutions, beams)
                ranges[codes == 65534] = -np.inf
                ranges[codes == 65535] = np.nan
                offset += 4 * math.ceil(count * beams / 2)
            else:
                assert bits == 32
                ranges = np.frombuffer(self.payload, "<f4", count * beams, offset)
                offset += 4 * count * beams
            scans = zip(poses, ranges.reshape(count, beams), strict=True)
            found.update(zip(ids, scans, strict=True))
        assert offset == len(self.payload)
        return found


class Decoder:
    """Decodes the binary messages of one connection, in their order."""

    def __init__(self) -> None:
        self._bodies: dict[int, list[int]] = {}  # of the last poses, by world

    def decode(self, data: bytes) -> Binary:
        binary = Binary(*HEADER.unpack_from(data), data[HEADER.size :])
        if binary.kind == 4:
            return dataclasses.replace(binary, kind=2, bodies=self._bodies[binary.world])
        if binary.kind == 2:
            self._bodies[binary.world] = list(binary.poses())
        return binary


class RawWebClient:
    """Connects to a viewer; keeps all messages in the order in which they arrive."""

    def __init__(self, url: str, *, look: bool = True, **options: Any) -> None:
        self._runner = asyncio.Runner()
        self._id = 0
        self.received: list[Any] = []
        self._decoder = Decoder()
        self.closed: aiohttp.WSMessage | None = None
        try:
            self._runner.run(self._connect(url, options))
            if look:
                self.ask("look", worlds=[0])
        except BaseException:
            self.close()
            raise

    async def _connect(self, url: str, options: Any) -> None:
        base, _, query = url.partition("?")
        self._session = aiohttp.ClientSession()
        self._socket = await self._session.ws_connect(
            f"{base}ws?{query}", protocols=["flatland.1"], max_msg_size=0, **options
        )

    def __enter__(self) -> RawWebClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disconnects; further calls have no effect."""
        if self._runner is None:
            return

        async def close() -> None:
            if hasattr(self, "_socket"):
                await self._socket.close()
            await self._session.close()

        self._runner.run(close())
        self._runner.close()
        self._runner = None  # type: ignore[assignment]

    def vanish(self) -> None:
        """Ends the connection without a word, like a machine that loses its power."""

        async def abort() -> None:
            self._socket._response.connection.transport.abort()  # type: ignore[union-attr]
            await asyncio.sleep(0)

        self._runner.run(abort())

    # -- to the server ---------------------------------------------------------------------

    def send_text(self, text: str) -> None:
        self._runner.run(self._socket.send_str(text))

    def send_many(self, texts: list[str]) -> None:
        """Sends messages without a pause, until the server has closed the connection."""

        async def send() -> None:
            with contextlib.suppress(ConnectionError):
                for text in texts:
                    await self._socket.send_str(text)

        self._runner.run(send())

    def send_bytes(self, data: bytes) -> None:
        self._runner.run(self._socket.send_bytes(data))

    def send(self, kind: str, **fields: Any) -> int:
        self._id += 1
        self.send_text(json.dumps({"id": self._id, "type": kind, **fields}))
        return self._id

    def reply(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Sends a message and returns its reply."""
        number = self.send(kind, **fields)
        return self.wait("reply", lambda message: message["id"] == number)

    def ask(self, kind: str, **fields: Any) -> Any:
        """Sends a message that must succeed and returns the result."""
        reply = self.reply(kind, **fields)
        assert reply["ok"], reply
        return reply["result"]

    # -- from the server -------------------------------------------------------------------

    def receive(self, timeout: float = TIMEOUT) -> Any:
        """Returns the next message: a dictionary, a `Binary`, or None at the end."""
        try:
            message = self._runner.run(self._socket.receive(timeout))
        except TimeoutError:
            raise TimeoutError("no message") from None
        if message.type is aiohttp.WSMsgType.TEXT:
            decoded: Any = json.loads(message.data)
        elif message.type is aiohttp.WSMsgType.BINARY:
            decoded = self._decoder.decode(message.data)
        else:
            self.closed = message
            return None
        self.received.append(decoded)
        return decoded

    def wait(self, kind: str | int, accept: Callable[[Any], bool] = lambda _: True) -> Any:
        """Returns the next message of a type or binary kind that is accepted."""
        end = time.monotonic() + TIMEOUT
        while time.monotonic() < end:
            message = self.receive()
            assert message is not None, f"the connection was closed: {self.closed}"
            found = message["type"] if isinstance(message, dict) else message.kind
            if found == kind and accept(message):
                return message
        raise TimeoutError(f"no message {kind}")

    def receive_until(self, kind: str) -> list[Any]:
        """Returns all messages up to the next one of a type."""
        start = len(self.received)
        self.wait(kind)
        return self.received[start:]

    def receive_for(self, seconds: float) -> list[Any]:
        """Returns all messages that arrive in some time."""
        end, found = time.monotonic() + seconds, []
        while (left := end - time.monotonic()) > 0:
            try:
                found.append(self.receive(left))
            except TimeoutError:
                break
        return found

    def wait_closed(self) -> tuple[int, str]:
        """Waits until the server closes the connection; returns the code and the reason."""
        while self.receive() is not None:
            pass
        assert self.closed is not None
        return self.closed.data, self.closed.extra

    def model(self, name: str) -> dict[str, Any]:
        """Returns the latest description of a model, which must have been received."""
        described = [
            model
            for message in self.received
            if isinstance(message, dict) and message["type"] == "models"
            for model in message["models"]
            if model["name"] == name
        ]
        return described[-1]

    def wait_model(self, name: str) -> dict[str, Any]:
        """Returns the description of a model, as soon as it is there."""
        try:
            return self.model(name)
        except IndexError:
            names = lambda message: [model["name"] for model in message["models"]]  # noqa: E731
            self.wait("models", lambda message: name in names(message))
            return self.model(name)
