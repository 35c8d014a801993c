"""All that the viewer asks of ROS, in threads of its own; the answers come as Qt signals.

The window's thread never waits for ROS: a simulator that hangs or is gone leaves the window
alive.
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

from flatland.msg import DebugTopicList
from flatland.viewer.bounds import bounds_of
from flatland.viewer.server import Server, ServerState

_LOG = logging.getLogger("flatland")
_PATIENCE: Final = 5.0  # s for a message that is there
_LOOK_EVERY: Final = 1.0  # s between two looks at what the simulator has registered


class RosLink(QObject):
    """The viewer's node.

    Signals are emitted from any thread; slots of objects of the window's thread run there.

    Attributes:
        server: Names of the simulator's topics and services.
    """

    debug_topics = pyqtSignal(list)  # names of marker topics, all that there are now
    layer_bounds = pyqtSignal(str, object)  # debug topic of a layer, its Bounds or None
    model_bounds = pyqtSignal(object)  # Bounds of all models or None
    paused = pyqtSignal(bool)
    state = pyqtSignal(object)  # ServerState
    _answered = pyqtSignal(object, object)  # function, its argument

    def __init__(self, server: Server) -> None:
        """Makes the link; `start` connects it."""
        super().__init__()
        self.server = server
        self._closed = threading.Event()
        self._measured: dict[str, Any] = {}  # subscribers by the topic of their layer
        self._measured_lock = threading.Lock()
        self._answered.connect(lambda function, argument: function(argument))

    def start(self) -> None:
        """Connects to the simulator, now or when it comes."""
        self.in_background(self._subscribe)
        self.in_background(self._watch)

    def close(self) -> None:
        """Ends the threads that wait."""
        self._closed.set()

    def in_background(
        self,
        work: Callable[[], Any],
        on_success: Callable[[Any], None] | None = None,
        on_failure: Callable[[str], None] | None = None,
    ) -> None:
        """Runs something that takes time.

        Args:
            work: Run in a thread of its own.
            on_success: Called with the result in the window's thread.
            on_failure: Called with the error's text in the window's thread; without it the error
                is logged.
        """

        def run() -> None:
            try:
                result = work()
            except Exception as error:
                if self._closed.is_set() or rospy.is_shutdown():
                    return
                if on_failure is None:
                    _LOG.exception("the viewer failed to do something in the background")
                else:
                    self._answered.emit(on_failure, str(error))
            else:
                if on_success is not None and not self._closed.is_set():
                    self._answered.emit(on_success, result)

        threading.Thread(target=run, daemon=True).start()

    def call(
        self,
        name: str,
        service_type: type[Any],
        *arguments: Any,
        on_success: Callable[[Any], None],
        on_failure: Callable[[str], None],
    ) -> None:
        """Calls a service of the simulator.

        Args:
            name: Of the service, in the simulator's namespace.
            service_type: The service class.
            arguments: The request's fields.
            on_success: Called with the response.
            on_failure: Called with the reason why there is none, or with the response's
                `message` when its `success` is false.
        """
        service = rospy.ServiceProxy(self.server.resolve(name), service_type)

        def answer(response: Any) -> None:
            if getattr(response, "success", True):
                on_success(response)
            else:
                on_failure(response.message)

        self.in_background(lambda: service(*arguments), answer, on_failure)

    def parameter(self, name: str) -> object:
        """Returns a parameter as the simulator's YAML files see it; not for the window's thread."""
        return rospy.get_param(self.server.resolve(name), None)

    def measure_models(self) -> None:
        """Finds out how far the models reach now; the answer is `model_bounds`."""
        topic = self.server.debug_topic("all_models")
        self.in_background(
            lambda: bounds_of(rospy.wait_for_message(topic, MarkerArray, _PATIENCE)),
            self.model_bounds.emit,
            lambda _reason: None,  # The simulator has gone meanwhile.
        )

    def _subscribe(self) -> None:
        debug_topics = self.server.resolve("~debug/topics")
        rospy.Subscriber(debug_topics, DebugTopicList, self._hear_topics)
        rospy.Subscriber(self.server.resolve("~paused"), Bool, lambda m: self.paused.emit(m.data))

    def _hear_topics(self, message: Any) -> None:
        topics = set(message.topics)
        self.debug_topics.emit(list(message.topics))
        # The walls in 3-D stand on the edges of the layer.
        walls = {f"{topic}_3d" for topic in topics}
        layers = {topic for topic in topics - walls if topic.startswith("layer/")}
        with self._measured_lock:
            for topic in self._measured.keys() - layers:
                self.in_background(self._measured.pop(topic).unregister)
            for topic in layers - self._measured.keys():
                self._measured[topic] = self._measure(topic)

    def _measure(self, topic: str) -> Any:
        """Finds out how far a layer reaches, now and when it has changed."""

        def hear(message: Any) -> None:
            self.layer_bounds.emit(topic, bounds_of(message))

        return rospy.Subscriber(self.server.debug_topic(topic), MarkerArray, hear)

    def _watch(self) -> None:
        """Looks again and again at what the simulator has registered, which nobody tells."""
        known: ServerState | None = None
        while not self._closed.is_set():
            state = self.server.look()
            if state != known:
                known = state
                self.state.emit(state)
            self._closed.wait(_LOOK_EVERY)
