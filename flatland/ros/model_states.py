"""The states of models: the topic `model_states` and the service `get_model_states`."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from geometry_msgs.msg import Pose2D, Twist, Vector3

from flatland.entities.model import Model
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.ros.adapters import convert
from flatland.ros.message_types import message_class, service_class
from flatland.ros.service_calls import CallError, ServiceCalls
from flatland.ros.transport.service import Service
from flatland.ros.transport.state_topic import StateTopic
from flatland.runtime.model_states import ModelStates
from flatland.runtime.observer import WorldObserver

TOPIC: Final = "model_states"
SERVICE: Final = "get_model_states"
FRAME: Final = "map"
"""Frame of the world, as of debug markers and interactive markers."""
_Message: Final = message_class("ModelStates")
_U32: Final = struct.Struct("<I")


class ModelStatesTopic(WorldObserver):
    """Publishes the poses and velocities of all models at a rate of simulated time.

    New subscribers receive the current states at once, and all subscribers when a model is spawned,
    moved or deleted, so that they are up to date while the world is paused. Without subscribers,
    the world is not observed.
    """

    def __init__(self, calls: ServiceCalls, rate: float) -> None:
        """Advertises the topic asynchronously.

        Args:
            calls: Access to the simulation.
            rate: Messages per second of simulated time [Hz]; 0 for one per step.
        """
        self._world = calls.simulation.world
        self._post = calls.simulation.post
        self._timer = UpdateTimer(rate or float("inf"))
        self._observing = False
        self._changed = False  # whether a message for a change is scheduled
        self._topic = StateTopic(
            calls.registrar,
            TOPIC,
            _Message,
            self._message,
            self._post,
            on_connection=self._connection_changed,
        )

    def _connection_changed(self, _connected: bool) -> None:
        self._post(self._observe)

    def _observe(self) -> None:
        """Observes the world while the topic has subscribers."""
        if self._topic.connected != self._observing and not self._world.closed:
            self._observing = not self._observing
            if self._observing:
                self._world.add_observer(self)
            else:
                self._world.remove_observer(self)

    def step_finished(self) -> None:
        """Publishes if an update is due."""
        if self._timer.check_update(self._world.timekeeper):
            self._topic.send()

    def model_added(self, model: Model) -> None:
        """Schedules a message."""
        del model
        self._schedule()

    def model_moved(self, model: Model) -> None:
        """Schedules a message."""
        del model
        self._schedule()

    def model_removed(self, model: Model) -> None:
        """Schedules a message."""
        del model
        self._schedule()

    def _schedule(self) -> None:
        """Schedules one message after the current request, for any number of changed models."""
        if not self._changed:
            self._changed = True
            self._post(self._send_change)

    def _send_change(self) -> None:
        self._changed = False
        if not self._world.closed:
            self._topic.send()

    def _message(self) -> Any:
        world = self._world
        header = convert.header(world.timekeeper.sim_time_ns, FRAME)
        namespaces = [model.namespace for model in world.models]
        return _PackedModelStates(header, namespaces, world.state())


class ModelStatesService:
    """Returns the poses and velocities of all models, or of some."""

    def __init__(self, calls: ServiceCalls) -> None:
        """Advertises the service asynchronously.

        Args:
            calls: Carries out the calls.

        Raises:
            FlatlandError: A plugin has a service of the same name.
        """
        self._calls = calls
        self._world = calls.simulation.world
        Service(calls.registrar, SERVICE, service_class("GetModelStates"), self._serve)

    def _serve(self, request: Any) -> tuple[bool, str, Any]:
        try:
            return True, "", self._calls.carry_out(lambda: self._states(request.names))
        except CallError as error:
            return False, str(error), _Message()

    def _states(self, names: Sequence[str]) -> Any:
        """Returns the message for some models; for all if there are no names."""
        world = self._world
        models = [world.model(name) for name in names] or world.models
        states = world.state()
        rows = {name: number for number, name in enumerate(states.names)}
        poses, twists = [], []
        for model in models:
            row = rows[model.name]
            poses.append(Pose2D(*states.poses[row].tolist()))
            vx, vy, omega = states.velocities[row].tolist()
            twists.append(Twist(Vector3(vx, vy, 0.0), Vector3(0.0, 0.0, omega)))
        return _Message(
            convert.header(world.timekeeper.sim_time_ns, FRAME),
            [model.name for model in models],
            [model.namespace for model in models],
            poses,
            twists,
        )


class _PackedModelStates(_Message):  # type: ignore[misc, valid-type]
    """A message whose poses and velocities are arrays, which are written as they are."""

    __slots__ = _Message.__slots__  # genpy reads the field names from here

    def __init__(self, header: Any, namespaces: list[str], states: ModelStates) -> None:
        """Stores the states."""
        super().__init__(header, states.names, namespaces, states.poses, states.velocities)

    def serialize(self, buff: Any) -> None:
        """Serializes the message; called by rospy."""
        self.header.serialize(buff)
        for texts in (self.name, self.ns):
            buff.write(_U32.pack(len(texts)))
            for text in texts:
                # Surrogates, of undecodable bytes in a file name, cannot be sent.
                encoded = text.encode("utf-8", "replace")
                buff.write(_U32.pack(len(encoded)) + encoded)
        count = _U32.pack(len(self.pose))
        buff.write(count)
        buff.write(self.pose.astype("<f8").tobytes())
        twists = np.zeros((len(self.pose), 6), "<f8")
        twists[:, [0, 1, 5]] = self.twist
        buff.write(count)
        buff.write(twists.tobytes())
