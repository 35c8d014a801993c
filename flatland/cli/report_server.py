"""Serves the report of `flatland test`; its links replay the runs in the viewer."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import BinaryIO, Final

from flatland.defaults import WEB_HOST
from flatland.errors import FlatlandError
from flatland.recording import Replay
from flatland.web.access import Access
from flatland.web.view import LiveView

REPORT: Final = "report.html"
_SUFFIX: Final = ".flog"
_CHECK_PERIOD: Final = 0.2  # s between two checks for a signal
_MAX_VIEWS: Final = 8  # replays that are shown at the same time

Repeat = Callable[[Replay, Callable[[], object]], object]
"""Repeats a run in real time, until a function returns a true value."""


class ReportServer(ThreadingHTTPServer):
    """Serves a folder of results on this machine.

    A request for a recording starts its replay, and is answered by the address of its viewer.

    Attributes:
        access: Access control.
    """

    daemon_threads = True
    timeout = _CHECK_PERIOD

    def __init__(self, folder: Path, load: Callable[[Path], Replay], repeat: Repeat) -> None:
        """Listens on a free port.

        Args:
            folder: The folder, which contains a report.
            load: Opens a recording.
            repeat: Called in a thread for each replay.
        """
        self.access = Access.for_host(WEB_HOST, None)
        self._load = load
        self._repeat = repeat
        self._views: dict[Path, _ReplayView] = {}
        self._lock = threading.Lock()
        super().__init__((WEB_HOST, 0), partial(_Handler, directory=str(folder)))

    @property
    def url(self) -> str:
        """Address of the report."""
        return self.access.url(self.server_port, None) + REPORT

    def replay(self, file: Path) -> str:
        """Replays a recording from its start in a viewer of its own, and returns the address.

        Raises:
            FlatlandError: The recording cannot be replayed.
        """
        with self._lock:
            if file in self._views:
                self._views.pop(file).close()
            while len(self._views) >= _MAX_VIEWS:
                self._views.pop(next(iter(self._views))).close()
            view = self._views[file] = _ReplayView(self._load(file), self._repeat)
            return view.url

    def server_close(self) -> None:
        """Ends all replays and stops listening."""
        super().server_close()
        with self._lock:
            while self._views:
                self._views.popitem()[1].close()


class _Handler(SimpleHTTPRequestHandler):
    """Answers a request: files of the folder, and redirections to viewers."""

    server: ReportServer

    def send_head(self) -> io.BytesIO | BinaryIO | None:
        """Sends the header of a file, or replays a recording."""
        file = Path(self.translate_path(self.path))
        if not self.server.access.allows_host(self.headers.get("Host", "")):
            self.send_error(HTTPStatus.FORBIDDEN, "unknown name of the server")
        elif file.suffix != _SUFFIX or not file.is_file():
            return super().send_head()
        else:
            self._replay(file)
        return None

    def _replay(self, file: Path) -> None:
        try:
            url = self.server.replay(file)
        except (FlatlandError, OSError) as error:
            self.send_error(HTTPStatus.CONFLICT, "the run cannot be replayed", str(error))
            return
        self.send_response(HTTPStatus.SEE_OTHER)
        self.send_header("Location", url)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *arguments: object) -> None:
        """Logs no requests."""


class _ReplayView:
    """A replay in the viewer; begins with the first browser, and shows its end until it is closed.

    Attributes:
        url: Address of the viewer.
    """

    def __init__(self, replay: Replay, repeat: Repeat) -> None:
        self._replay = replay
        self._repeat = repeat
        self._closed = threading.Event()
        try:
            self._view = LiveView(replay.world, WEB_HOST, 0, None, read_only=True, height=480)
        except BaseException:
            replay.close()
            raise
        self.url = self._view.url
        self._thread = threading.Thread(target=self._run, name="flatland-replay", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the replay and the viewer."""
        self._closed.set()
        self._thread.join()
        self._replay.close()

    def _run(self) -> None:
        while not self._view.is_watched:
            if self._closed.wait(_CHECK_PERIOD):
                return
        self._repeat(self._replay, self._closed.is_set)
