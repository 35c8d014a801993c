"""ROS subscriptions and calls of the viewer, in background threads; results are Qt signals.

The window's thread never waits for ROS, so that the window stays responsive if the simulator
hangs or ends.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Final

import rospy
from PyQt5.QtCore import QObject, pyqtSignal
from std_msgs.msg import Bool
from visualization_msgs.msg import MarkerArray

from flatland.ros.message_types import message_class
from flatland.viewer.bounds import bounds_of
from flatland.viewer.simulator_client import SimulatorClient, SimulatorState

_LOG = logging.getLogger("flatland")
_MESSAGE_TIMEOUT: Final = 5.0  # s for the first message of a latched topic
_STATE_POLL_PERIOD: Final = 1.0  # s


class RosLink(QObject):
    """The viewer's ROS node.

    Signals are emitted from any thread; slots of objects that live in the window's thread run
    in that thread.

    Attributes:
        simulator: Names and state of the simulator.
    """

    debug_topics = pyqtSignal(list)  # all present names of marker topics
    layer_bounds = pyqtSignal(str, object)  # debug topic of a layer, its Bounds or None
    model_bounds = pyqtSignal(object)  # Bounds of all models or None
    paused = pyqtSignal(bool)
    state = pyqtSignal(object)  # SimulatorState
    _callback_requested = pyqtSignal(object, object)  # function, its argument

    def __init__(self, simulator: SimulatorClient) -> None:
        """Creates the link; `start` connects it."""
        super().__init__()
        self.simulator = simulator
        self._closed = threading.Event()
        self._layer_subscribers: dict[str, Any] = {}  # by debug topic
        self._layer_lock = threading.Lock()
        self._callback_requested.connect(lambda function, argument: function(argument))

    def start(self) -> None:
        """Subscribes to the simulator's topics and starts polling its state.

        The simulator need not be running yet.
        """
        self.run_in_background(self._subscribe)
        self.run_in_background(self._poll_state)

    def close(self) -> None:
        """Stops polling; results that arrive later are discarded."""
        self._closed.set()

    def run_in_background(
        self,
        work: Callable[[], Any],
        on_success: Callable[[Any], None] | None = None,
        on_failure: Callable[[str], None] | None = None,
    ) -> None:
        """Runs a function in a new thread.

        Args:
            work: The function to run.
            on_success: Called with the result, in the window's thread.
            on_failure: Called with the error message, in the window's thread. By default, errors
                are logged.
        """

        def run() -> None:
            try:
                result = work()
            except Exception as error:
                if self._closed.is_set() or rospy.is_shutdown():
                    return
                if on_failure is None:
                    _LOG.exception("unexpected error in a background thread of the viewer")
                else:
                    self._callback_requested.emit(on_failure, str(error))
            else:
                if on_success is not None and not self._closed.is_set():
                    self._callback_requested.emit(on_success, result)

        threading.Thread(target=run, daemon=True).start()

    def call(
        self,
        name: str,
        service_type: type[Any],
        *arguments: Any,
        on_success: Callable[[Any], None],
        on_failure: Callable[[str], None],
    ) -> None:
        """Calls a service of the simulator in the background.

        Args:
            name: Name of the service, relative to the simulator's namespace.
            service_type: The service class.
            arguments: Fields of the request.
            on_success: Called with the response.
            on_failure: Called with the error message if the call fails, or with the `message` of
                the response if its `success` is false.
        """
        service = rospy.ServiceProxy(self.simulator.resolve(name), service_type)

        def handle_response(response: Any) -> None:
            if getattr(response, "success", True):
                on_success(response)
            else:
                on_failure(response.message)

        self.run_in_background(lambda: service(*arguments), handle_response, on_failure)

    def parameter(self, name: str) -> object:
        """Returns a ROS parameter, resolved as `param()` in the simulator's YAML files resolves it.

        Waits for the ROS master: not to be called in the window's thread.
        """
        return rospy.get_param(self.simulator.resolve(name), None)

    def request_model_bounds(self) -> None:
        """Computes the present bounds of all models in the background; emits `model_bounds`."""
        topic = self.simulator.debug_topic("all_models")
        self.run_in_background(
            lambda: bounds_of(rospy.wait_for_message(topic, MarkerArray, _MESSAGE_TIMEOUT)),
            self.model_bounds.emit,
            lambda _reason: None,  # The simulator has ended in the meantime.
        )

    def _subscribe(self) -> None:
        debug_topics = self.simulator.resolve("~debug/topics")
        # The package of the type depends on the simulator, and may change with its next start.
        rospy.Subscriber(debug_topics, rospy.AnyMsg, self._on_debug_topics)
        rospy.Subscriber(
            self.simulator.resolve("~paused"), Bool, lambda message: self.paused.emit(message.data)
        )

    def _on_debug_topics(self, serialized: Any) -> None:
        message = message_class("DebugTopicList")()
        message.deserialize(serialized._buff)
        topics = set(message.topics)
        self.debug_topics.emit(list(message.topics))
        # The walls of a layer (`…_3d`) have the same bounds as its edges.
        walls = {f"{topic}_3d" for topic in topics}
        layers = {topic for topic in topics - walls if topic.startswith("layer/")}
        with self._layer_lock:
            for topic in self._layer_subscribers.keys() - layers:
                self.run_in_background(self._layer_subscribers.pop(topic).unregister)
            for topic in layers - self._layer_subscribers.keys():
                self._layer_subscribers[topic] = self._subscribe_to_layer(topic)

    def _subscribe_to_layer(self, topic: str) -> Any:
        """Subscribes to the markers of a layer, to emit `layer_bounds` whenever they change."""

        def on_markers(message: Any) -> None:
            self.layer_bounds.emit(topic, bounds_of(message))

        return rospy.Subscriber(self.simulator.debug_topic(topic), MarkerArray, on_markers)

    def _poll_state(self) -> None:
        """Emits `state` when it has changed; ROS has no notification for that."""
        last_state: SimulatorState | None = None
        while not self._closed.is_set():
            state = self.simulator.query_state()
            if state != last_state:
                last_state = state
                self.state.emit(state)
            self._closed.wait(_STATE_POLL_PERIOD)
