"""The server node: a world on ROS, from its parameters to its exit code."""

from __future__ import annotations

import argparse
import gc
import importlib
import logging
import math
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future, wait
from contextlib import closing
from typing import TYPE_CHECKING, Final

from flatland.node.parameters import (
    MESSAGE_PACKAGES,
    OWN_PACKAGE,
    ParameterError,
    read_parameters,
)
from flatland.node.run import NodeRun
from flatland.ros.message_types import select_package
from flatland.ros.rospy_import import defer_catkin, shorten_registration
from flatland.ros_addresses import connection_problem, master_address

if TYPE_CHECKING:
    from flatland.ros.transport.registrar import Registrar

_LOG = logging.getLogger("flatland")

NODE_NAME: Final = "flatland_server"
_MASTER_POLL_PERIOD: Final = 0.2  # s between two attempts to reach the ROS master
_MASTER_WARNING_TIMEOUT: Final = 1.0  # s without a ROS master until a warning is logged
_REGISTRATION_TIMEOUT: Final = 0.1  # s, for the registration of `/clock`
_UNREGISTER_TIMEOUT: Final = 2.0  # s
_STOP_POLL_PERIOD: Final = 0.05  # s between two checks for a stop request without a master
_SHUTDOWN_POLL_PERIOD: Final = 0.002  # s
_SERVED_WORLD: Final = "flatland.node.served_world"
# The reason that the ROS master gives to a node whose name another node has taken.
_REPLACED: Final = "new node registered with same name"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the node.

    Args:
        arguments: Arguments of the command line; None for the arguments of the process.

    Returns:
        The exit code: 0 after a requested stop or a complete benchmark, 1 after a failure, whose
        cause is logged at critical level.
    """
    parser = argparse.ArgumentParser(
        prog=NODE_NAME,
        description="The simulator node of flatland. Parameters are set as _NAME:=VALUE.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "--msgs-package",
        choices=MESSAGE_PACKAGES,
        default=OWN_PACKAGE,
        help="package of the message and service types, if ~msgs_package is not set",
    )
    # The remaining arguments are read by rospy.
    options, _ = parser.parse_known_args(arguments)
    # During the start, the collector would examine the objects of all modules several times.
    gc.disable()
    try:
        return ServerNode(options.msgs_package).run()
    finally:
        gc.enable()


class ServerNode:
    """One run of the node."""

    def __init__(self, default_msgs_package: str = OWN_PACKAGE) -> None:
        """Prepares the run.

        Args:
            default_msgs_package: Default of the parameter `msgs_package`.
        """
        self._default_msgs_package = default_msgs_package
        self._run = NodeRun(_is_fault_of_client, _unregister)
        self._registrar: Registrar | None = None
        self._replaced = False  # whether another node has the name of this one

    def run(self) -> int:
        """Runs until a stop is requested, and returns the exit code."""
        defer_catkin()
        import rosgraph
        import rospy

        # While this thread waits for responses of the master. Not a daemon: the interpreter must
        # not end while an extension is imported.
        threading.Thread(
            target=importlib.import_module, args=(_SERVED_WORLD,), name="flatland-import"
        ).start()
        try:
            if not self._wait_for_master():
                return 0
        except ValueError as error:
            _LOG.critical("%s (from ROS_MASTER_URI)", error)
            return 1
        from flatland.ros.logs import log_to_ros, log_without_file
        from flatland.ros.transport import inbound

        inbound.install()
        log_without_file()
        shorten_registration()
        try:
            # Without rostime, rospy does not subscribe to `/clock`; the bridge sets its time.
            rospy.init_node(NODE_NAME, disable_signals=True, disable_rostime=True)
        except rospy.ROSInitException as error:
            if self._run.stopping.is_set():
                return 0
            logging.getLogger("rosout").critical("%s", error)
            return 1

        def shut_down(reason: str) -> None:
            self._replaced |= _REPLACED in reason
            self._run.watchdog.request_stop()

        # Before the hook of rospy that unregisters the node. `rospy.on_shutdown` passes no reason.
        rospy.core._preshutdown_hooks.insert(0, shut_down)
        log_to_ros()
        code = self._run.exit_code_of(self._simulate)
        if self._replaced:
            _LOG.critical(
                'another node has taken the name "%s" on the ROS master at %s: this one ends',
                rospy.get_name(),
                rosgraph.get_master_uri(),
            )
            code = 1
        if self._registrar is not None:
            self._registrar.close(_UNREGISTER_TIMEOUT)
        _unregister()
        return code

    def _wait_for_master(self) -> bool:
        """Waits for the ROS master; returns False if a stop is requested first.

        Raises:
            ValueError: The address of the master is invalid.
        """
        import rosgraph

        uri = rosgraph.get_master_uri()
        host, port = master_address(uri)
        found: Future[None] = Future()
        reason = "there is no response"

        def search() -> None:
            nonlocal reason
            try:
                while not rosgraph.is_master_online():
                    reason = connection_problem(host, port) or "it is no ROS master"
                    time.sleep(_MASTER_POLL_PERIOD)
                found.set_result(None)
            except Exception as error:
                found.set_exception(error)

        # In a separate thread, because a server that is not a ROS master may accept the call and
        # never respond.
        threading.Thread(target=search, name="flatland-master-search", daemon=True).start()
        warning_due = time.monotonic() + _MASTER_WARNING_TIMEOUT
        while not self._run.stopping.is_set():
            if wait([found], timeout=_STOP_POLL_PERIOD).done:
                found.result()
                return True
            if time.monotonic() > warning_due:
                # To standard error, because rospy logs nothing without a master.
                _LOG.warning("waiting for the ROS master at %s (%s)", uri, reason)
                warning_due = math.inf
        return False

    def _replace(self) -> None:
        """Ends the node because another one has its name; safe from any thread."""
        self._replaced = True
        self._run.watchdog.request_stop()

    def _simulate(self) -> None:
        """Loads the world and steps it until a stop is requested.

        Raises:
            ParameterError: A parameter is invalid, or the package of the message types is not
                installed.
            FlatlandError: The world cannot be loaded.
        """
        from flatland.ros.parameter_server import ParameterServer

        server = ParameterServer()
        parameters = read_parameters(server.get, default_msgs_package=self._default_msgs_package)
        self._run.watchdog.timeout = parameters.shutdown_timeout
        package = parameters.msgs_package
        try:
            # Before the imports below, which fix the types of the topics.
            select_package(package)
        except ImportError as error:
            raise ParameterError(
                f'Invalid parameter "~msgs_package": "{package}" is not installed, {error}'
            ) from error
        from flatland.node.clock import NodeClock, SimulatedClock, WallClock
        from flatland.ros.transport.registrar import Registrar
        from flatland.ros.transport.ros_transport import RosTransport

        _check_time_of_other_nodes(parameters.use_sim_time, server.use_sim_time is True)
        self._registrar = Registrar()
        self._registrar.keep_parameters(server.found())
        transport = RosTransport(self._registrar)
        clock: NodeClock
        if parameters.use_sim_time:
            clock = SimulatedClock(transport, parameters.clock_rate)
        else:
            clock = WallClock()
        # Other nodes have a valid time while the world is loaded.
        self._registrar.flush(_REGISTRATION_TIMEOUT)
        from flatland.ros.transport.master_watch import MasterWatch
        from flatland.ros.transport.network_check import NetworkCheck

        check_network = NetworkCheck(publishes_clock=parameters.use_sim_time)
        watch = MasterWatch(self._registrar, self._replace, check_network)
        with closing(watch) as master_watch:
            # Closed before the topics, so that no topic is registered again.
            self._run.serve(parameters, transport, clock, ended=master_watch.close)


def _is_fault_of_client(error_type: type[BaseException]) -> bool:
    """Returns whether rospy ends the thread of a client that sends an invalid request."""
    from rospy.exceptions import TransportException

    return issubclass(error_type, TransportException)


def _check_time_of_other_nodes(use_sim_time: bool, others: bool) -> None:
    """Logs a warning if other nodes use another time than the stamps of this one.

    Args:
        use_sim_time: Whether this node uses simulated time.
        others: Whether other nodes do.
    """
    if use_sim_time and not others:
        _LOG.warning("/use_sim_time is not true: other nodes do not follow the simulated time")
    elif others and not use_sim_time:
        _LOG.warning(
            "/use_sim_time is true, but this node uses wall time and publishes no /clock: the time "
            "of other nodes stands still; set /use_sim_time to false before they start"
        )


def _unregister() -> None:
    """Unregisters all topics and services of the node from the ROS master.

    rospy does this at the start of its shutdown and then sleeps for more than half a second. The
    process does not wait for that part.
    """
    import rospy

    threading.Thread(target=rospy.signal_shutdown, args=("shutdown",), daemon=True).start()
    end = time.monotonic() + _UNREGISTER_TIMEOUT
    while not rospy.is_shutdown() and time.monotonic() < end:
        time.sleep(_SHUTDOWN_POLL_PERIOD)
