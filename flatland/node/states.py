"""Topics with the state of a world: `~paused` and `model_states`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from flatland.entities.model import Model
from flatland.node.ticker import Ticker
from flatland.node.transport import Transport
from flatland.node.values import WORLD_FRAME, StampedModelStates
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.runtime.model_states import ModelStates
from flatland.runtime.observer import WorldObserver
from flatland.simulation import Simulation
from flatland.world import World

PAUSED_TOPIC: Final = "~paused"
PAUSED_RATE: Final = 20.0  # Hz, wall time
STATES_TOPIC: Final = "model_states"


class PauseTopic:
    """Publishes the pause state of a world when it changes.

    The state is polled while the topic has subscribers, because services, drags and plugins pause
    a world independently of each other.
    """

    def __init__(self, transport: Transport, simulation: Simulation) -> None:
        """Advertises the topic asynchronously; must be called between two steps.

        Args:
            transport: Publishes the topic.
            simulation: Simulation of the world.
        """
        self._world = simulation.world
        self._sent: bool | None = None  # last state sent to all subscribers; None if they differ
        self._ticker = Ticker("flatland-paused", PAUSED_RATE, simulation.post, self._tick)
        self._topic = transport.state_of(
            PAUSED_TOPIC,
            bool,
            self._state,
            simulation.post,
            lambda _connected: self._ticker.wake(),
        )

    def close(self) -> None:
        """Stops polling."""
        self._ticker.close()

    def _state(self) -> bool:
        if self._world.paused != self._sent:
            # Only new subscribers receive this message; the others still have the old state.
            self._sent = None
        return self._world.paused

    def _tick(self, _now: float) -> bool:
        if self._world.paused != self._sent:
            self._topic.send()
            self._sent = self._world.paused
        return self._topic.connected


class ModelStatesTopic(WorldObserver):
    """Publishes the poses and velocities of all models at a rate of simulated time.

    New subscribers receive the current states at once, and all subscribers when a model is spawned,
    moved or deleted, so that they are up to date while the world is paused. Without subscribers,
    the world is not observed.
    """

    def __init__(self, transport: Transport, simulation: Simulation, rate: float) -> None:
        """Advertises the topic asynchronously.

        Args:
            transport: Publishes the topic.
            simulation: Simulation of the world.
            rate: Messages per second of simulated time [Hz]; 0 for one per step.
        """
        self._world = simulation.world
        self._post = simulation.post
        self._timer = UpdateTimer(rate or float("inf"))
        self._observing = False
        self._changed = False  # whether a message for a change is scheduled
        self._topic = transport.state_of(
            STATES_TOPIC,
            StampedModelStates,
            lambda: stamped_states(self._world),
            self._post,
            lambda _connected: self._post(self._observe),
        )

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
        """Schedules one message after the current request, for any number of changed models."""
        del model
        if not self._changed:
            self._changed = True
            self._post(self._send_change)

    model_moved = model_removed = model_added

    def _send_change(self) -> None:
        self._changed = False
        if not self._world.closed:
            self._topic.send()


def stamped_states(world: World, names: Sequence[str] = ()) -> StampedModelStates:
    """Returns the states of some models of a world; of all if there are no names.

    Raises:
        WorldError: A model does not exist.
    """
    models = [world.model(name) for name in names] or world.models
    states = world.state()
    if names:
        numbers = {name: number for number, name in enumerate(states.names)}
        rows = [numbers[name] for name in names]
        states = ModelStates(tuple(names), states.poses[rows], states.velocities[rows])
    return StampedModelStates(
        world.timekeeper.sim_time_ns,
        WORLD_FRAME,
        states.names,
        [model.namespace for model in models],
        states.poses,
        states.velocities,
    )
