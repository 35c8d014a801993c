"""The part of a world that its plugins can use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    import os
    from concurrent.futures import Future

    import numpy as np

    from flatland.config.reader import YamlReader
    from flatland.defaults import IfBlocked
    from flatland.entities.body import Body
    from flatland.entities.collision_filter import CollisionFilter
    from flatland.entities.contact import Contact
    from flatland.entities.layer import Layer
    from flatland.entities.model import Model
    from flatland.geometry import DoubleArray, Pose
    from flatland.physics import PhysicsWorld
    from flatland.plugin_api.plugin import FlatlandPlugin
    from flatland.plugin_api.port_registry import PortRegistry
    from flatland.plugin_api.ports import CommandTopic, Output
    from flatland.timekeeper import Timekeeper
    from flatland.values import Transform

R = TypeVar("R")


class TransformSender(Protocol):
    """Collects the transforms that plugins send."""

    def register(self, plugin: FlatlandPlugin, frames: tuple[str, str]) -> None:
        """Registers a pair of frames that a plugin starts to send."""

    def declare(
        self, plugin: FlatlandPlugin, frames: tuple[str, str], pose: Pose | None, switch: str
    ) -> None:
        """Registers a pair of frames that a plugin is going to send."""

    def send(self, frames: tuple[str, str], fields: tuple[int, float, float, float, float]) -> None:
        """Adds a transform (stamp, x, y, yaw, roll) of this step."""

    def add_past(
        self, frames: tuple[str, str], fields: tuple[int, float, float, float, float]
    ) -> None:
        """Adds a transform of an earlier step."""

    def forget(self, plugin: FlatlandPlugin, frames: Iterable[tuple[str, str]]) -> None:
        """Drops the transforms of a plugin that ended."""


class PluginJobs(Protocol):
    """A queue of functions of plugins that run before the next step."""

    def set_later(self, plugin: FlatlandPlugin, function: Callable[[], None]) -> None:
        """Queues a function that runs before the next step; safe from any thread."""


class JobOwner(Protocol):
    """The owner of the jobs of plugins."""

    @property
    def jobs(self) -> PluginJobs:
        """The jobs."""


class PluginFiles(Protocol):
    """Reads the files of a world."""

    def resolve(self, path: str) -> str:
        """Returns an absolute path; a relative path starts from the folder of the world file."""

    def read(self, path: str) -> YamlReader:
        """Loads and preprocesses a YAML file."""


class PluginWorld(Protocol):
    """The part of `flatland.World` that plugins use; its methods are described there."""

    @property
    def seed(self) -> int:
        """Seed of all random numbers."""

    @property
    def timekeeper(self) -> Timekeeper:
        """The simulated time."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def physics(self) -> PhysicsWorld:
        """The physics world."""

    @property
    def collision_filter(self) -> CollisionFilter:
        """Layer names and their bits."""

    @property
    def source(self) -> PluginFiles:
        """Reads the files of the world."""

    @property
    def ports(self) -> PortRegistry:
        """All outputs and commands by resolved topic."""

    @property
    def transform_buffer(self) -> TransformSender:
        """Collects the transforms of plugins."""

    @property
    def plugin_host(self) -> JobOwner:
        """Calls the plugins."""

    @property
    def layers(self) -> Sequence[Layer]:
        """The layers in the order of the file."""

    @property
    def models(self) -> Sequence[Model]:
        """All models in the order in which they were spawned."""

    @property
    def transforms(self) -> dict[tuple[str, str], Transform]:
        """The latest transform of each (parent, child)."""

    @property
    def contacts(self) -> list[Contact]:
        """All pairs of fixtures that touch now."""

    @property
    def paused(self) -> bool:
        """Whether steps have no effect."""

    def pause(self) -> None:
        """Pauses the world from the next step on."""

    def resume(self) -> None:
        """Resumes a paused world."""

    def layer(self, name: str) -> Layer:
        """Returns the layer that has a name."""

    def layer_changed(self, layer: Layer) -> None:
        """Notifies the observers that the edges of a layer changed."""

    def model(self, name: str) -> Model:
        """Returns the model of a name."""

    def body_of_id(self, body_id: int) -> Body:
        """Returns the body of a model or a layer by its id."""

    def spawn_model(
        self,
        yaml_path: str | os.PathLike[str],
        name: str,
        namespace: str = "",
        pose: Sequence[float] = (0.0, 0.0, 0.0),
        if_blocked: IfBlocked = "warn",
    ) -> Model | None:
        """Reads a model file and adds the model to the world."""

    def spawn_models(
        self, models: Iterable[Any], if_blocked: IfBlocked = "warn"
    ) -> list[Model] | None:
        """Adds several models, given as `ModelSpec`: all of them, or none."""

    def move_model(
        self,
        name: str,
        pose: Sequence[float],
        if_blocked: IfBlocked = "warn",
        *,
        keep_odometry: bool = False,
    ) -> Model | None:
        """Moves a model rigidly so that its first body is at a pose, at rest."""

    def delete_model(self, name: str) -> None:
        """Removes a model."""

    def delete_models(self, names: Iterable[str]) -> None:
        """Removes several models: all of them, or none."""

    def sample_free(
        self,
        n: int,
        radius: float,
        clearance: float = 0.0,
        rng: np.random.Generator | int | None = None,
        *,
        connected_to: Sequence[float] | None = None,
        layers: str | Iterable[str] = "all",
        bounds: Sequence[float] | None = None,
    ) -> DoubleArray:
        """Samples random free poses, shape (n, 3)."""

    def reset(self, seed: int | None = None, keep_time: bool = False) -> None:
        """Returns to the state after loading."""

    def call_plugin(
        self,
        plugin: FlatlandPlugin | str,
        method: str,
        arguments: Mapping[str, object],
        model: str = "",
    ) -> Any:
        """Calls a method of a plugin between two steps, as a change of the world."""

    def output(self, topic: str) -> Output[Any]:
        """Returns the output of a resolved topic, and makes it wanted."""

    def command(self, topic: str) -> CommandTopic[Any]:
        """Returns the commands of a resolved topic."""

    def post(self, action: Callable[[], R]) -> Future[R]:
        """Queues an action that runs between two steps."""

    def between_steps(self, action: Callable[[], R]) -> R:
        """Returns the result of a function that reads the world between two steps."""
