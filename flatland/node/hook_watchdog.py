"""Reports a plugin that blocks the simulation in one of its hooks or callbacks."""

from __future__ import annotations

import logging
import sys
import threading
import time
import traceback
from types import FrameType
from typing import Final

from flatland.node.stacks import call_name, plugin_call
from flatland.world import World

_LOG = logging.getLogger("flatland")

LIMIT: Final = 5.0  # s of wall time
_POLL_PERIOD: Final = 0.5  # s


class HookWatchdog:
    """Inspects the thread that steps a world, from a separate thread.

    Hooks have no additional cost: the stack of the thread is inspected twice a second, and only
    while the simulated time stands still. A hook or callback that has not returned for `LIMIT` is
    logged once, with the stack; calls of services that wait for it are refused from then on.
    `on_initialize` has a limit of its own, `~plugin_timeout`.
    """

    def __init__(self, world: World) -> None:
        """Starts watching the calling thread.

        Args:
            world: The world that the calling thread steps.
        """
        self._world = world
        self._thread = threading.get_ident()
        self._time_ns = -1
        # The call that is in progress. The frame is kept, so that no other call can be at the same
        # address; it is dropped half a second after its call has ended.
        self._frame: FrameType | None = None
        self._since = 0.0
        self._closed = threading.Event()
        threading.Thread(target=self._run, name="flatland-hook-watchdog", daemon=True).start()

    def close(self) -> None:
        """Ends the thread."""
        self._closed.set()

    def _run(self) -> None:
        while not self._closed.wait(_POLL_PERIOD):
            try:
                self._check(time.monotonic())
            except Exception:
                _LOG.exception("cannot inspect the thread of the simulation")

    def _check(self, now: float) -> None:
        time_ns = self._world.timekeeper.sim_time_ns
        call = None
        if time_ns == self._time_ns:
            frame = sys._current_frames().get(self._thread)
            call = None if frame is None else plugin_call(frame)
            del frame
        self._time_ns = time_ns
        requests = self._world.requests
        if call is None or call[1] is not self._frame:
            if requests.blocked_by:
                _LOG.warning(
                    "%s has returned after %.0f s, the simulation continues",
                    requests.blocked_by,
                    now - self._since,
                )
                requests.blocked_by = ""
            self._frame, self._since = None if call is None else call[1], now
            return
        plugin, frame = call
        if now - self._since < LIMIT or requests.blocked_by:
            return
        if frame.f_code.co_name != "on_initialize":
            requests.blocked_by = call_name(plugin, frame)
            innermost = sys._current_frames()[self._thread]
            _LOG.error(
                "%s has not returned for %.0f s, the simulation waits for it:\n%s",
                requests.blocked_by,
                now - self._since,
                "".join(traceback.format_stack(innermost)).rstrip(),
            )
