"""The HTTP server: the files of the page, and the connections of clients."""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Final

from aiohttp import WSCloseCode, web

from flatland.web.access import Access, is_loopback
from flatland.web.client import Client
from flatland.web.hub import Hub
from flatland.web.messages import MAX_SIZE
from flatland.web.page_files import PageFile, PageFiles

_LOG = logging.getLogger("flatland")

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

PAGE: Final = Path(__file__).parent / "page"
SUBPROTOCOL: Final = "flatland.1"
WRONG_TOKEN: Final = 4401  # code that closes a connection
HEARTBEAT: Final = 10.0  # s between two pings; a client that does not reply is disconnected
MAX_CLIENTS: Final = 64

# Never changes, because another version of the page has other paths.
_KEEP: Final = "public, max-age=31536000, immutable"
_GZIP: Final = re.compile(r"(^|[\s,])gzip\s*($|,|;\s*q=(1|0\.0*[1-9]))")
_POLICY: Final = (
    "default-src 'self'; img-src 'self' data: blob:; media-src 'self' blob:; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors {ancestors}"
)
# Notebooks on this machine show the page in a frame.
_LOCAL_ANCESTORS: Final = (
    "'self' http://localhost:* http://127.0.0.1:* https://localhost:* https://127.0.0.1:*"
)


class Server:
    """Serves the HTTP requests of browsers."""

    def __init__(
        self,
        hub: Hub,
        access: Access,
        on_request: Callable[[asyncio.Transport | None], None],
        *,
        embeddable: bool,
    ) -> None:
        """Creates a server.

        Args:
            hub: The worlds.
            access: Access control.
            on_request: Called with the connection of each request.
            embeddable: Whether pages of all other sites may show the page in a frame.
        """
        self._hub = hub
        self._access = access
        self._on_request = on_request
        self._files = PageFiles(PAGE)
        ancestors = _LOCAL_ANCESTORS if is_loopback(access.host) else "'self'"
        if embeddable:
            ancestors = "*"
        self._headers = {
            "Content-Security-Policy": _POLICY.format(ancestors=ancestors),
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",  # The address contains the token.
            "Cache-Control": "no-cache",  # Browsers compare the ETag of the start page.
        }

    def application(self) -> web.Application:
        """Returns the application of aiohttp."""
        application = web.Application(middlewares=[self._check], client_max_size=1024)
        application.on_response_prepare.append(_hide_version)
        application.router.add_get("/ws", self._connect)
        application.router.add_get("/{path:.*}", self._file)
        return application

    @web.middleware
    async def _check(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        self._on_request(request.transport)
        if not self._access.allows_host(request.host):
            return web.Response(status=403, text="unknown name of the server in the header Host\n")
        try:
            response: web.StreamResponse = await handler(request)
        except (web.HTTPException, ConnectionError):
            raise
        except Exception:
            _LOG.exception("unexpected internal error in the web viewer")
            return web.Response(status=500, text="internal error\n")
        return response

    async def _file(self, request: web.Request) -> web.StreamResponse:
        path = request.match_info["path"]
        if path in ("", "index.html"):
            return self._answer(request, self._files.index, {})
        file = self._files.asset(path)
        if file is None:
            return web.Response(status=404, text="not found\n", headers=self._headers)
        return self._answer(request, file, {"Cache-Control": _KEEP})

    def _answer(
        self, request: web.Request, file: PageFile, more: dict[str, str]
    ) -> web.StreamResponse:
        # A weak tag, which the compressed and the plain form share.
        headers = {**self._headers, **more, "Content-Type": file.kind, "ETag": f'W/"{file.tag}"'}
        headers["Vary"] = "Accept-Encoding"
        if any(known.value in (file.tag, "*") for known in request.if_none_match or ()):
            return web.Response(status=304, headers=headers)
        if file.compressed is None or not _GZIP.search(request.headers.get("Accept-Encoding", "")):
            return web.Response(body=file.content, headers=headers)
        headers["Content-Encoding"] = "gzip"
        return web.Response(body=file.compressed, headers=headers)

    async def _connect(self, request: web.Request) -> web.StreamResponse:
        if not self._access.allows_origin(request.headers.get("Origin"), request.host):
            return web.Response(status=403, text="pages of other sites may not connect\n")
        socket = web.WebSocketResponse(
            protocols=(SUBPROTOCOL,), heartbeat=HEARTBEAT, max_msg_size=MAX_SIZE, compress=False
        )
        if not socket.can_prepare(request):
            return web.Response(status=400, text="a WebSocket is expected\n")
        await socket.prepare(request)
        token = request.query.get("token", "")
        if not self._access.allows_token(token):
            await asyncio.sleep(0.5)  # slows down attempts to guess the token
            await socket.close(code=WRONG_TOKEN, message=b"the token is missing or wrong")
        elif len(self._hub.clients) >= MAX_CLIENTS:
            await socket.close(code=WSCloseCode.TRY_AGAIN_LATER, message=b"too many clients")
        else:
            read_only = self._access.is_read_only(token)
            await self._hub.serve(Client(socket, self._hub.feeds, read_only=read_only))
        return socket


async def _hide_version(_request: web.Request, response: web.StreamResponse) -> None:
    response.headers["Server"] = "flatland"
