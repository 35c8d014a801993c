"""What a controller can access of its world: queries, without any way to change something.

A view has the same names as the object that it shows. Values are copies, and objects that belong to
the world are views in turn. The objects themselves are not attributes of their views, so that a
controller does not change the world by accident or as a shortcut. Python cannot keep code in the
same process from doing so on purpose.
"""

from __future__ import annotations

import dataclasses
import weakref
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final, Generic, Literal, NoReturn, TypeVar, overload

import numpy as np

from flatland.entities.body import Body
from flatland.entities.joint import Joint
from flatland.entities.layer import Layer
from flatland.entities.model import Model
from flatland.errors import FlatlandError
from flatland.geometry import DoubleArray, FloatArray, Pose, Vector2
from flatland.physics import PhysicsFixture
from flatland.plugin_api.ports import Output
from flatland.runtime.model_states import ModelStates
from flatland.timekeeper import Timekeeper
from flatland.values import Transform
from flatland.world import World

T = TypeVar("T")


class ViewError(FlatlandError, AttributeError):
    """A controller may not access this."""

    prefix = "Flatland controller: "


class _View:
    """Shows an object of the world for queries."""

    __slots__ = ("__weakref__",)

    def __getattr__(self, name: str) -> NoReturn:
        """Raises the error for everything that is not part of the view."""
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise ViewError(
            f'"{name}" of {_shown(self)} is not available: a controller can only query the world '
            f"({', '.join(_queries(type(self)))}), and drives the robot by the command it returns"
        )

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Raises an error."""
        raise ViewError(f'"{name}" of {_shown(self)} cannot be set by a controller')

    def __delattr__(self, name: str) -> NoReturn:
        """Raises an error."""
        raise ViewError(f'"{name}" of {_shown(self)} cannot be deleted by a controller')

    def __reduce__(self) -> NoReturn:
        """Raises an error."""
        raise ViewError(f"{_shown(self)} of a controller cannot be copied")

    def __repr__(self) -> str:
        return f"<view of {_TARGETS[self]!r}>"


def _shown(view: _View) -> str:
    kind = type(view).__name__.removesuffix("View").lower()
    return f"a {kind}" if kind != "world" else "the world"


def _queries(kind: type[_View]) -> Iterator[str]:
    return (name for name in vars(kind) if not name.startswith("_"))


_TARGETS: Final[weakref.WeakKeyDictionary[_View, Any]] = weakref.WeakKeyDictionary()
# The view of an object by its identity, which exists for as long as the view.
_VIEWS: Final[weakref.WeakValueDictionary[int, _View]] = weakref.WeakValueDictionary()


class _Query(Generic[T]):
    """An attribute of the object behind a view."""

    def __set_name__(self, _owner: type, name: str) -> None:
        self._name = name

    def __get__(self, view: _View, _owner: type | None = None) -> T:
        if view is None:  # of the class
            return self  # type: ignore[unreachable]
        found: T = _protected(getattr(_TARGETS[view], self._name))
        return found

    def __set__(self, view: _View, value: object) -> NoReturn:
        view.__setattr__(self._name, value)


class TimekeeperView(_View):
    """The simulated time and the step size, see `flatland.timekeeper.Timekeeper`."""

    __slots__ = ()
    step_size = _Query[float]()
    step_size_ns = _Query[int]()
    sim_time = _Query[float]()
    sim_time_ns = _Query[int]()


class FixtureView(_View):
    """A shape of a body."""

    __slots__ = ()
    shape = _Query[Literal["circle", "polygon", "edge"]]()
    vertices = _Query[FloatArray]()
    center = _Query[Vector2]()
    radius = _Query[float]()
    is_sensor = _Query[bool]()
    density = _Query[float]()
    friction = _Query[float]()
    restitution = _Query[float]()
    category_bits = _Query[int]()
    mask_bits = _Query[int]()


class BodyView(_View):
    """A body of a model."""

    __slots__ = ()
    name = _Query[str]()
    class_name = _Query[str]()
    type = _Query[str]()
    pose = _Query[Pose]()
    velocity = _Query[tuple[float, float, float]]()
    color = _Query[tuple[float, float, float, float]]()
    fixtures = _Query[list[FixtureView]]()


class JointView(_View):
    """A joint of a model."""

    __slots__ = ()
    name = _Query[str]()
    type = _Query[str]()
    bodies = _Query[tuple[BodyView, BodyView]]()
    anchors = _Query[DoubleArray]()
    limits = _Query[tuple[float, float] | None]()


class ModelView(_View):
    """A model, see `flatland.entities.model.Model`."""

    __slots__ = ()
    name = _Query[str]()
    namespace = _Query[str]()
    path = _Query[str]()
    class_name = _Query[str]()
    pose = _Query[Pose]()
    origin = _Query[Pose]()
    bodies = _Query[list[BodyView]]()
    joints = _Query[list[JointView]]()

    def body(self, name: str) -> BodyView:
        """Returns the body with a name.

        Raises:
            WorldError: The body does not exist.
        """
        return view_of(behind(self).body(name))

    def joint(self, name: str) -> JointView:
        """Returns the joint with a name.

        Raises:
            WorldError: The joint does not exist.
        """
        return view_of(behind(self).joint(name))

    def frame(self, frame_id: str) -> str:
        """Returns the TF frame id of a frame of the model."""
        return behind(self).frame(frame_id)


class LayerView(_View):
    """A layer, with its walls as edges."""

    __slots__ = ()
    name = _Query[str]()
    names = _Query[list[str]]()
    category_bits = _Query[int]()
    edges = _Query[FloatArray]()
    world_edges = _Query[DoubleArray]()


class OutputView(_View):
    """An output of a plugin, such as the odometry: `latest` is the last value, None before it."""

    __slots__ = ()
    topic = _Query[str]()
    latest = _Query[Any]()


class WorldView(_View):
    """A world, see `flatland.World`."""

    __slots__ = ()
    path = _Query[str]()
    seed = _Query[int]()
    time = _Query[float]()
    timekeeper = _Query[TimekeeperView]()
    layers = _Query[list[LayerView]]()
    models = _Query[list[ModelView]]()
    transforms = _Query[dict[tuple[str, str], Transform]]()

    def layer(self, name: str) -> LayerView:
        """Returns the layer with a name.

        Raises:
            WorldError: The layer does not exist.
        """
        return view_of(behind(self).layer(name))

    def model(self, name: str) -> ModelView:
        """Returns the model with a name.

        Raises:
            WorldError: The model does not exist.
        """
        return view_of(behind(self).model(name))

    def output(self, topic: str) -> OutputView:
        """Returns the output of a resolved topic, such as `/odom`.

        Raises:
            WorldError: The output does not exist.
        """
        shown: OutputView = view_of(behind(self).output(topic))
        return shown

    def state(self) -> ModelStates:
        """Returns the names, poses and velocities of all models."""
        return behind(self).state()

    def is_free(
        self,
        pose: Sequence[float],
        radius: float | None = None,
        *,
        model: str | ModelView | None = None,
        layers: str | Iterable[str] = "all",
        clearance: float = 0.0,
        ignore: str | ModelView | Iterable[str | ModelView] = (),
    ) -> bool:
        """Returns whether a disc or a model does not overlap anything, see `World.is_free`."""
        return behind(self).is_free(
            pose,
            radius,
            model=_name(model),
            layers=layers,
            clearance=clearance,
            ignore=_names(ignore),
        )

    def sample_free(
        self,
        n: int,
        radius: float,
        clearance: float = 0.0,
        *,
        rng: np.random.Generator | int,
        connected_to: Sequence[float] | None = None,
        layers: str | Iterable[str] = "all",
        bounds: Sequence[float] | None = None,
        ignore: str | ModelView | Iterable[str | ModelView] = (),
    ) -> DoubleArray:
        """Samples random free poses, see `World.sample_free`.

        Args:
            n: Number of poses.
            radius: Radius of the discs [m].
            clearance: Distance that the discs keep [m].
            rng: Generator or seed, such as `task.rng`; the random numbers of the world are not
                available.
            connected_to: A point (x, y) in the world frame [m] from which a path leads to each.
            layers: Names of the layers that the discs collide with.
            bounds: (x_min, y_min, x_max, y_max) of the area [m].
            ignore: Models, or their names, that may be overlapped.

        Returns:
            (x, y, theta) of each pose [m, rad], shape (n, 3).
        """
        return behind(self).sample_free(
            n,
            radius,
            clearance,
            rng,
            connected_to=connected_to,
            layers=layers,
            bounds=bounds,
            ignore=_names(ignore),
        )


def _name(model: str | ModelView | None) -> str | None:
    return model.name if isinstance(model, ModelView) else model


def _names(models: str | ModelView | Iterable[str | ModelView]) -> list[str]:
    several = [models] if isinstance(models, str | ModelView) else models
    return [each if isinstance(each, str) else each.name for each in several]


_KINDS: Final[tuple[tuple[type, type[_View]], ...]] = (
    (World, WorldView),
    (Timekeeper, TimekeeperView),
    (Layer, LayerView),
    (Model, ModelView),
    (Body, BodyView),
    (PhysicsFixture, FixtureView),
    (Joint, JointView),
    (Output, OutputView),
)


@overload
def view_of(target: World) -> WorldView: ...
@overload
def view_of(target: Layer) -> LayerView: ...
@overload
def view_of(target: Model) -> ModelView: ...
@overload
def view_of(target: Body) -> BodyView: ...
@overload
def view_of(target: Joint) -> JointView: ...
@overload
def view_of(target: Output[Any]) -> OutputView: ...
@overload
def view_of(target: object) -> Any: ...


def view_of(target: object) -> Any:
    """Returns the view of an object of a world, the same one as long as it is in use."""
    kind = next(view for known, view in _KINDS if isinstance(target, known))
    view = _VIEWS.get(id(target))
    if view is None or type(view) is not kind:
        view = object.__new__(kind)
        _TARGETS[view] = target
        _VIEWS[id(target)] = view
    return view


@overload
def behind(view: WorldView) -> World: ...
@overload
def behind(view: ModelView) -> Model: ...


def behind(view: Any) -> Any:
    """Returns the object that a view shows; for the parts of the simulator that plan paths."""
    return _TARGETS[view]


def _protected(value: Any) -> Any:
    """Returns what a controller gets of a value: views, and copies of what can change."""
    match value:
        case None | str() | bool() | int() | float():
            return value
        case np.ndarray():
            return value.copy()
        case list():
            return [_protected(item) for item in value]
        case tuple():
            return tuple(_protected(item) for item in value)
        case dict():
            return {key: _protected(item) for key, item in value.items()}
    if isinstance(value, tuple(known for known, _ in _KINDS)):
        return view_of(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {one.name: getattr(value, one.name) for one in dataclasses.fields(value)}
        arrays = {
            name: each.copy() for name, each in fields.items() if isinstance(each, np.ndarray)
        }
        return dataclasses.replace(value, **arrays) if arrays else value
    return value
