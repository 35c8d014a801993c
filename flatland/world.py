"""The world: layers, models and plugins, stepped together."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from flatland.config.inputs import Inputs
from flatland.config.node import Source
from flatland.config.preprocessor import Params
from flatland.defaults import WEB_HOST
from flatland.entities.collision_filter import CollisionFilter
from flatland.entities.layer import Layer
from flatland.errors import WorldError
from flatland.loading.world_loader import load_world
from flatland.physics import PhysicsWorld
from flatland.plugin_api.noise import checked_seed
from flatland.plugin_api.port_registry import PortRegistry
from flatland.runtime.body_monitor import BodyMonitor, InvalidBodyPolicy
from flatland.runtime.contacts import ContactReporter
from flatland.runtime.contents import Contents
from flatland.runtime.faults import FaultPolicy, Faults
from flatland.runtime.model_set import ModelSet
from flatland.runtime.observer import Observers, WorldObserver
from flatland.runtime.placement import Placement
from flatland.runtime.plugin_host import PluginHost
from flatland.runtime.requests import Requests
from flatland.runtime.snapshot import WorldStates
from flatland.runtime.stepping import Stepping
from flatland.runtime.transforms import TransformBuffer
from flatland.timekeeper import Timekeeper

if TYPE_CHECKING:
    from flatland.recording import Recorder
    from flatland.web.view import LiveView

_LOG = logging.getLogger("flatland")


class World(Contents):
    """A simulated world; created by `World.from_yaml`.

    One thread steps it. Other threads may spawn, move and delete models and set commands at any
    time: their requests are carried out between two steps (`flatland.runtime.requests`).

    Attributes:
        timekeeper: The simulated time.
        physics: The physics world: ray casts, and all that is not part of models and layers.
        collision_filter: Layer names and their bits.
        velocity_iterations: Velocity iterations of the Box2D solver.
        position_iterations: Position iterations of the Box2D solver.
        seed: Seed of all random numbers.
        params: Source of the values of `param()` in YAML files.
        path: The world file, as given; relative model paths start from its folder.
        plugin_errors: Policy for exceptions, see `from_yaml`.
        on_invalid_body: Policy for invalid bodies, see `from_yaml`.
    """

    def __init__(  # noqa: D417 - the other arguments are those of from_yaml
        self,
        *,
        seed: int | None = None,
        params: Params = None,
        step_size: float = 0.005,
        velocity_iterations: int = 10,
        position_iterations: int = 10,
        base_dir: str | os.PathLike[str] = ".",
        observers: Iterable[WorldObserver] = (),
        plugin_timeout: float | None = None,
        plugin_errors: FaultPolicy = "raise",
        on_invalid_body: InvalidBodyPolicy = "raise",
    ) -> None:
        """Creates an empty world; `from_yaml` describes the other arguments.

        Args:
            velocity_iterations: Velocity iterations of the Box2D solver.
            position_iterations: Position iterations of the Box2D solver.
            base_dir: Folder that relative paths of models and maps start from.

        Raises:
            ValueError: An argument is out of range.
        """
        if plugin_timeout is not None and not plugin_timeout > 0:
            raise ValueError(f"plugin_timeout must be positive [s] or None, got {plugin_timeout}")
        self.timekeeper = Timekeeper(step_size)
        self.plugin_errors, self.on_invalid_body = plugin_errors, on_invalid_body
        self._faults = Faults(plugin_errors)
        self.seed = checked_seed(seed)
        self.velocity_iterations = velocity_iterations
        self.position_iterations = position_iterations
        self.params = params
        self.path = ""
        self.inputs = Inputs()
        self.collision_filter = CollisionFilter()
        self.layers, self._former_layers = list[Layer](), dict[str, Layer]()
        self.physics = PhysicsWorld()
        self._files = Source("", str(Path(base_dir).absolute()))
        self.requests = Requests()
        self._observers = Observers(self._faults)
        self.transform_buffer = TransformBuffer(self._observers)
        self.plugin_host = PluginHost(
            self, self._observers, self.requests, self._faults, plugin_timeout
        )
        self.ports = PortRegistry(
            self._observers, self._faults.add_of_subscriber, self.plugin_host.schedule.change
        )
        self._contacts = ContactReporter(self.physics, self.plugin_host)
        self._placement = Placement(self, self._contacts)
        self._models = ModelSet(
            self, self.plugin_host, self._contacts, self._placement, self._observers, self.requests
        )
        self._body_monitor = BodyMonitor(
            self.physics, self._contacts, self._models, on_invalid_body
        )
        self.stepping = Stepping(
            self, self._contacts, self._body_monitor, self._observers, self._faults
        )
        self.requests.on_post = self.physics.plan.interrupt
        self.change_count = 0
        self._paused = False
        self._closed = False
        self._view: LiveView | None = None
        self.add_observer(self._body_monitor)
        self._states = WorldStates(self, (*vars(self), "map_layer"))
        for observer in observers:
            self.add_observer(observer)

    @classmethod
    def from_yaml(
        cls,
        path: str | os.PathLike[str],
        seed: int | None = None,
        params: Params = None,
        simplify_map: int = 0,
        step_size: float = 0.005,
        observers: Iterable[WorldObserver] = (),
        plugin_timeout: float | None = None,
        plugin_errors: FaultPolicy = "raise",
        on_invalid_body: InvalidBodyPolicy = "raise",
        model_path: Iterable[str | os.PathLike[str]] | None = None,
    ) -> World:
        """Loads a world file: properties, layers, models with their plugins, world plugins.

        Args:
            path: The world file.
            seed: Seed of all random numbers, at least 0; None draws a seed and logs it.
            params: Source of the values of `param()` in YAML files: a dictionary, or a function
                that returns None for an unknown name.
            simplify_map: 0 exact, 1 simplified, 2 opened and simplified map boundaries.
            step_size: Simulated time of one step [s].
            observers: Receive notifications of all events from the start.
            plugin_timeout: Limit of wall time of `on_initialize` of a plugin [s], None for no
                limit; see `flatland.runtime.time_limit`.
            plugin_errors: What happens to exceptions of hooks, subscribers and observers; none of
                them interrupts a step. `raise`: `step` raises the first one when the step is
                complete. `disable`: they are logged, and a plugin whose hook raises three times in
                a row is disabled.
            on_invalid_body: What happens if a step leaves a body with a pose or velocity that is
                not finite. `raise`: `step` raises, and raises again, until the model is moved or
                deleted; the time stands still. `remove`: the model is removed with a logged error.
            model_path: Folders outside which `spawn_model` reads no file; None: no restriction.

        Raises:
            FlatlandError: A file is invalid; nothing is left behind.
            ValueError: An argument is out of range.
        """
        world = load_world(
            cls,
            path,
            params=params,
            simplify_map=simplify_map,
            seed=seed,
            step_size=step_size,
            observers=observers,
            plugin_timeout=plugin_timeout,
            plugin_errors=plugin_errors,
            on_invalid_body=on_invalid_body,
            model_path=model_path,
        )
        # Otherwise part of the first step, which would take too long for a loop in real time.
        world.physics.find_new_contacts()
        return world

    def __enter__(self) -> World:
        """Returns the world, which is closed at the end of the block."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Closes the world; an exception of the block takes precedence over those of plugins."""
        try:
            self.close()
        except Exception:
            if error is None:
                raise
            _LOG.exception("closing the world failed")

    def __repr__(self) -> str:
        """Returns the file, the time and the number of layers and models."""
        file = "/".join(Path(self.path).parts[-2:])
        if self._closed:
            return f"<World {file!r}, closed>"
        counts = f"layers: {len(self.layers)}, models: {len(self._models.by_name)}"
        return f"<World {file!r} at {self.time:.3f} s, {counts}>"

    # -- time ------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.timekeeper.sim_time

    def step(self, n: int = 1, *, while_paused: bool = False) -> None:
        """Steps `n` times; has no effect on a paused world unless `while_paused` is true.

        Raises:
            WorldError: The world is closed, a plugin calls this, or a body is not finite.
            Exception: Raised by a plugin, subscriber or observer, with `plugin_errors="raise"`.
        """
        self.stepping.step(n, while_paused=while_paused)

    # -- recordings and images -------------------------------------------------------------

    def record(self, path: str | os.PathLike[str]) -> Recorder:
        """Records this run, so that `flatland replay` can repeat it and find differences.

        Args:
            path: The file; an existing one is replaced.

        Returns:
            The recorder; its `close` ends the recording, as does the end of the world.

        Raises:
            WorldError: The world was not loaded from a file, or has changed since.
            RecordingError: The file cannot be written.
        """
        from flatland.recording import Recorder  # Late: the simulation does not depend on it.

        recorder = Recorder(self, path)
        self.log_changes(recorder)
        self.add_observer(recorder)
        return recorder

    def draw(
        self,
        *,
        size: tuple[int, int] | None = None,
        dpi: float = 100.0,
        view: Sequence[float] | None = None,
        layers: Iterable[str] | None = None,
        scans: bool = True,
        names: bool = False,
        axes: bool = True,
    ) -> npt.NDArray[np.uint8]:
        """Draws the current state of the world; see `flatland.draw` for the arguments.

        Returns:
            RGB image, top row first, shape (height, width, 3).

        Raises:
            FlatlandError: The world is closed, a layer does not exist, or matplotlib is missing.
            ValueError: `size`, `dpi`, `view` or `layers` is invalid.
        """
        # Imported late: the simulation does not depend on drawing.
        from flatland.drawing import draw

        return draw(
            self, size=size, dpi=dpi, view=view, layers=layers, scans=scans, names=names, axes=axes
        )

    def view(
        self,
        *,
        host: str = WEB_HOST,
        port: int = 0,
        token: str | None = None,
        read_only: bool = False,
        height: int = 480,
    ) -> LiveView:
        """Shows the world live: as the result of a cell of a notebook, else at a printed address.

        The view ends with the world. A further call replaces it.

        Args:
            host: Address to listen on; `0.0.0.0` for access from other machines.
            port: TCP port, 0 for any free one.
            token: Part of the address, None for a random one.
            read_only: Whether the page only displays the world.
            height: Height in a notebook [pixels].

        Raises:
            FlatlandError: The world is closed, or the port is in use.
            ValueError: An argument is out of range.
        """
        from flatland.web.view import open_view  # Late, as in `draw`.

        return open_view(self, host, port, token, read_only, height)

    def _repr_png_(self) -> bytes | None:
        """Returns a PNG image for Jupyter; None for a closed world and without matplotlib."""
        from flatland.drawing import draw_png

        return draw_png(self)

    # -- end -------------------------------------------------------------------------------

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    def check_open(self) -> None:
        """Raises `WorldError` if the world is closed."""
        if self._closed:
            raise WorldError("the world is closed")

    def close(self) -> None:
        """Ends all plugins and releases everything; further calls have no effect.

        Raises:
            WorldError: A plugin calls this.
            Exception: Raised by a plugin or observer, with `plugin_errors="raise"`.
        """
        self.requests.refuse_in_plugin("close")
        with self.requests.lock:
            if self._closed:
                return
            if self.stepping.change_log is not None:
                self.stepping.change_log.world_closing()
            self.plugin_host.shut_down(list(self.plugin_host.world_plugins))
            for model in reversed(self.models):
                self._models.delete(model.name)
            self._closed = True
            self._observers.remove_all()
            self._contacts.clear()
            self.physics.close()
            # Requests that wait fail, since the world is closed.
            self.requests.process()
        self._faults.raise_first()
