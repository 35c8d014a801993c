"""One run of a node: stop requests, the world until then, and the exit code."""

from __future__ import annotations

import gc
import logging
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from typing import TYPE_CHECKING, Any, Final

from flatland.errors import FlatlandError
from flatland.node.fault_reports import FaultReports
from flatland.node.parameters import ParameterError
from flatland.node.shutdown import ShutdownWatchdog
from flatland.streams import accept_any_text

if TYPE_CHECKING:
    from flatland.node.clock import NodeClock
    from flatland.node.parameters import NodeParameters
    from flatland.node.served_world import ServedWorld
    from flatland.node.transport import Transport
    from flatland.simulation import Simulation

_LOG = logging.getLogger("flatland")

_SWITCH_INTERVAL: Final = 0.0002  # s for which a thread keeps the GIL while others wait for it


class NodeRun:
    """What the main programs for all kinds of ROS have in common.

    Attributes:
        stopping: Set when a stop is requested.
        watchdog: Receives signals, and limits the time of the shutdown.
    """

    def __init__(
        self,
        is_fault_of_client: Callable[[type[BaseException]], bool],
        unregister: Callable[[], None],
    ) -> None:
        """Handles signals from now on; must be called in the main thread, before anything else.

        Args:
            is_fault_of_client: See `FaultReports`.
            unregister: See `ShutdownWatchdog`.
        """
        accept_any_text()
        self.stopping = threading.Event()
        self.watchdog = ShutdownWatchdog(self._stop, unregister)
        self._simulation: Simulation | None = None
        self._has_incomplete_files = False
        self._fault_reports = FaultReports(is_fault_of_client)
        self._fault_reports.install()
        # The threads of client libraries need the GIL about a hundred times for a connection or
        # registration. With the default interval of 5 ms, this takes up to a second beside a loop
        # at full speed. A short interval costs nothing while no other thread waits for the GIL.
        sys.setswitchinterval(_SWITCH_INTERVAL)

    def _stop(self) -> None:
        """Ends the simulation after the current step; safe from any thread."""
        self.stopping.set()
        if self._simulation is not None:
            self._simulation.stop()

    def fail(self, text: str, **options: Any) -> int:
        """Logs a failure.

        Args:
            text: The reason.
            options: Further arguments of the log.

        Returns:
            The exit code: 0 if a stop was requested, which may have caused the failure.
        """
        if self.stopping.is_set():
            _LOG.info("stopped: %s", text)
            return 0
        _LOG.critical("%s", text, **options)
        return 1

    def exit_code_of(self, simulate: Callable[[], None]) -> int:
        """Runs a function that serves a world, and logs its failure.

        Args:
            simulate: The function.

        Returns:
            The exit code; 1 also if a recording is incomplete.
        """
        try:
            simulate()
        except ParameterError as error:
            return self.fail(str(error))
        except FlatlandError as error:
            return self.fail(error.text_with_hint)
        except Exception:
            return self.fail("unexpected internal error", exc_info=True)
        return 1 if self._has_incomplete_files else 0

    def serve(
        self,
        parameters: NodeParameters,
        transport: Transport,
        clock: NodeClock,
        more: Callable[[ServedWorld], AbstractContextManager[None]] = lambda _served: nullcontext(),
        ended: Callable[[], None] = lambda: None,
    ) -> None:
        """Loads a world and steps it until a stop is requested.

        Args:
            parameters: The parameters of the node.
            transport: Publishes, subscribes and serves.
            clock: The clock of the node.
            more: Serves what only one kind of ROS has.
            ended: Called when the simulation has ended, before topics are closed.

        Raises:
            ParameterError: A parameter does not fit the world.
            FlatlandError: The world cannot be loaded.
        """
        # Late, because the import would delay the registration of the clock.
        from flatland.node.served_world import ServedWorld

        # The collector need not examine the objects of modules, neither in a pause of a step nor at
        # the end of the process, where this would take most of the time.
        gc.freeze()
        with closing(ServedWorld(parameters, transport, clock)) as served, more(served):
            self._fault_reports.world = served.world
            self._simulation = served.simulation
            if self.stopping.is_set():
                served.simulation.stop()
            gc.enable()
            served.run()
            ended()
        for path, reason in served.incomplete_files.items():
            self._has_incomplete_files = True
            _LOG.error('"%s" is incomplete: %s', path, reason)
