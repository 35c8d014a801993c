"""The server node: a world on ROS, from its parameters to its exit code."""

from __future__ import annotations

import logging
import sys
import threading
import time
from typing import TYPE_CHECKING, Any, Final

from flatland.errors import FlatlandError
from flatland.ros.parameters import NodeParameters, ParameterError, read_parameters
from flatland.ros.shutdown import StopSignals

if TYPE_CHECKING:
    from flatland.ros.registrar import Registrar
    from flatland.simulation import RunResult, Simulation
    from flatland.world import World

_LOG = logging.getLogger("flatland")

NODE_NAME: Final = "flatland_server"
_MASTER_PERIOD: Final = 0.2  # s between two attempts to reach the ROS master
_MASTER_PATIENCE: Final = 1.0  # s without one until the node says that it waits
_SWITCH_INTERVAL: Final = 0.0002  # s for which a thread keeps the GIL while others wait for it
_UNREGISTERING: Final = 0.5  # s that saying good-bye to the ROS master may take


def main() -> int:
    """Runs the node.

    Returns:
        The exit code: 0 after a stop that was asked for, 1 after a failure, which one fatal log
        line tells.
    """
    return ServerNode().run()


class ServerNode:
    """One run of the node."""

    def __init__(self) -> None:
        """Does nothing yet."""
        self._stopping = threading.Event()
        self._simulation: Simulation | None = None
        self._registrar: Registrar | None = None

    def run(self) -> int:
        """Runs until the node is asked to stop, and returns the exit code."""
        # Before anything that takes time: a signal must find someone who hears it.
        StopSignals(self._stop, lambda: _leave_ros("signal"))
        # rospy's threads need the GIL some hundred times for one connection or registration. With
        # Python's interval of 5 ms that takes up to a second beside a loop at full speed. A short
        # interval costs nothing while no other thread waits for the GIL.
        sys.setswitchinterval(_SWITCH_INTERVAL)
        import rospy

        try:
            if not self._wait_for_master():
                return 0
        except ValueError as error:
            _LOG.critical("%s (from ROS_MASTER_URI)", error)
            return 1
        try:
            # Without rostime: rospy would subscribe to our own clock. The bridge sets its time.
            rospy.init_node(NODE_NAME, disable_signals=True, disable_rostime=True)
        except rospy.ROSInitException as error:
            if self._stopping.is_set():
                return 0
            logging.getLogger("rosout").critical("%s", error)
            return 1
        from flatland.ros.logs import log_to_ros

        rospy.on_shutdown(self._stop)
        log_to_ros()
        try:
            self._simulate(read_parameters(_private_parameter))
        except (ParameterError, FlatlandError) as error:
            code = self._fail(str(error))
        except Exception:
            code = self._fail("the simulator failed in an unforeseen way", exc_info=True)
        else:
            code = 0
        if self._registrar is not None:
            self._registrar.close(_UNREGISTERING)
        _leave_ros("the simulation ended")
        return code

    def _wait_for_master(self) -> bool:
        """Waits until a ROS master answers; returns False when the node is stopped first.

        Raises:
            ValueError: The address of the master is none.
        """
        import rosgraph

        # To standard error: rospy's logs begin with a master. By the clock, since a program that
        # is no master may take our question and never answer.
        uri = rosgraph.get_master_uri()
        notice = threading.Timer(
            _MASTER_PATIENCE, lambda: _LOG.warning("waiting for the ROS master at %s", uri)
        )
        notice.daemon = True
        notice.start()
        try:
            while not rosgraph.is_master_online():
                if self._stopping.wait(_MASTER_PERIOD):
                    return False
        finally:
            notice.cancel()
        return True

    def _stop(self) -> None:
        """Makes the simulation end soon; safe from any thread."""
        self._stopping.set()
        if self._simulation is not None:
            self._simulation.stop()

    def _fail(self, text: str, **options: Any) -> int:
        if self._stopping.is_set():
            # What a stop in the middle of loading leads to is no failure.
            _LOG.info("stopped: %s", text)
            return 0
        _LOG.critical("%s", text, **options)
        return 1

    def _simulate(self, parameters: NodeParameters) -> None:
        """Loads the world and steps it until the node is asked to stop."""
        from flatland.ros.bridge import Bridge
        from flatland.ros.deferred_topics import DeferredTopics
        from flatland.ros.registrar import Registrar
        from flatland.ros.services import Services
        from flatland.simulation import Simulation

        _warn_of_wall_time()
        self._registrar = Registrar()
        bridge = Bridge(self._registrar)
        world = _load(parameters, bridge)
        simulation = Simulation(
            world,
            parameters.update_rate,
            max_lag=parameters.max_lag,
            report=lambda report: _LOG.info("%s", report),
        )
        self._simulation = simulation
        if self._stopping.is_set():
            simulation.stop()
        debug_rate = parameters.viz_pub_rate if parameters.show_viz else None
        deferred_topics = DeferredTopics(self._registrar, simulation, debug_rate=debug_rate)
        try:
            Services(self._registrar, simulation, parameters.if_blocked)
            if parameters.benchmark_duration is None:
                simulation.run()
            else:
                result = simulation.run(parameters.benchmark_duration)
                if not simulation.stopped:
                    _log_benchmark(result)
        finally:
            deferred_topics.close()
            # Plugins end first, so that they can still publish; then all topics at once.
            bridge.close()
            world.close()


def _load(parameters: NodeParameters, bridge: Any) -> World:
    from flatland.world import World

    start = time.perf_counter()
    world = World.from_yaml(
        parameters.world_path,
        seed=parameters.seed,
        params=_yaml_parameter,
        simplify_map=parameters.simplify_map,
        step_size=parameters.step_size,
        observers=[bridge],
        plugin_timeout=parameters.plugin_timeout,
        plugin_errors="disable",
        on_invalid_body="remove",
    )
    _LOG.info(
        'loaded "%s" in %.2f s: %d layers, %d models',
        world.path,
        time.perf_counter() - start,
        len(world.layers),
        len(world.models),
    )
    return world


def _log_benchmark(result: RunResult) -> None:
    _LOG.info(
        "benchmark: %d iterations in %.3f s of wall time, %.1f iterations a second",
        result.steps,
        result.wall_time,
        result.steps_per_second,
    )


def _private_parameter(name: str) -> object:
    """Looks up a parameter of the node; `simplify_map` may also be set outside of it."""
    import rospy

    resolved = rospy.resolve_name(f"~{name}")
    if name == "simplify_map":
        # Looks in the node's own namespace first, then in each one above it.
        resolved = rospy.search_param(name) or resolved
    return rospy.get_param(resolved, None)


def _yaml_parameter(name: str) -> object:
    """Answers `param()` in YAML files; relative names are under the node's namespace."""
    import rospy

    return rospy.get_param(name, None)


def _warn_of_wall_time() -> None:
    import rospy

    if rospy.get_param("/use_sim_time", False) is not True:
        _LOG.warning("/use_sim_time is not true: other nodes will not follow the simulated time")


def _leave_ros(reason: str) -> None:
    """Takes the node's topics and services off the ROS master.

    rospy's shutdown does that first and then sleeps for more than half a second, which nobody
    needs to wait for: the process ends.
    """
    import rospy

    threading.Thread(target=rospy.signal_shutdown, args=(reason,), daemon=True).start()
    end = time.monotonic() + _UNREGISTERING
    while not rospy.is_shutdown() and time.monotonic() < end:
        time.sleep(0.002)
