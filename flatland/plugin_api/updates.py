"""Functions of plugins that are called when an update is due, so that other steps are cheap."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

from flatland.plugin_api.ports import Output

if TYPE_CHECKING:
    from flatland.entities.body import Body
    from flatland.geometry import Pose
    from flatland.physics import Touches
    from flatland.plugin_api.update_timer import UpdateTimer
    from flatland.timekeeper import Timekeeper

H = TypeVar("H", bound=Callable[..., None])

Phase = Literal["before", "after"]
"""Before the physics step, at time t, or after it, at time t + dt."""

UpdateFunction = Callable[["Timekeeper"], None]

SkippedHandler = Callable[[int, int, "Sequence[Pose]"], None]
"""Called as `handler(count, stamp, poses)`, see `FlatlandPlugin.on_update`."""

STEP_HOOKS: Final[dict[Phase, str]] = {
    "before": "before_physics_step",
    "after": "after_physics_step",
}

_MARK: Final = "_flatland_when_due"


class Update:
    """A function that is called when an update is due; see `FlatlandPlugin.on_update`.

    Attributes:
        function: The function.
        timer: Determines when updates are due.
        phase: When in a step it is called.
        transforms: Whether the function sends transforms.
        bodies: Bodies whose poses `skipped` needs.
        skipped: Accounts for updates without a call.
        touches: Contacts that are cleared at updates without a call.
        at_touches: Whether to call the function also in steps with contacts in `touches`.
        prepare: Performs a part of several successive updates together.
    """

    __slots__ = (
        "_outputs",
        "at_touches",
        "bodies",
        "function",
        "on_change",
        "phase",
        "prepare",
        "skipped",
        "timer",
        "touches",
        "transforms",
    )

    def __init__(
        self,
        function: UpdateFunction,
        timer: UpdateTimer,
        phase: Phase,
        *,
        outputs: Iterable[Output[Any]] | None,
        transforms: bool,
        bodies: Iterable[Body],
        skipped: SkippedHandler | None,
        touches: Touches | None,
        at_touches: bool,
        prepare: Callable[[Sequence[Any]], object] | None,
    ) -> None:
        """Creates an update; see `FlatlandPlugin.on_update`."""
        if phase not in STEP_HOOKS:
            raise ValueError(f'phase must be "before" or "after", got {phase!r}')
        self.function = function
        self.timer = timer
        self.phase = phase
        self.transforms = transforms
        self.bodies = tuple(bodies)
        self.skipped = skipped
        self.touches = touches
        self.at_touches = at_touches
        self.prepare = prepare
        self.on_change: Callable[[], None] | None = None
        self._outputs = _checked_outputs(outputs)

    @property
    def outputs(self) -> tuple[Output[Any], ...] | None:
        """Outputs that the function computes; None if it is always called. Settable.

        Raises:
            TypeError: One of them is no `Output`.
        """
        return self._outputs

    @outputs.setter
    def outputs(self, outputs: Iterable[Output[Any]] | None) -> None:
        self._outputs = _checked_outputs(outputs)
        if self.on_change is not None:
            self.on_change()

    def is_wanted(self, transforms_wanted: bool) -> bool:
        """Returns whether anything needs the result.

        Args:
            transforms_wanted: Whether an observer wants transforms.
        """
        if self._outputs is None or (self.transforms and transforms_wanted):
            return True
        return any(output.wanted for output in self._outputs)


def _checked_outputs(outputs: Iterable[Output[Any]] | None) -> tuple[Output[Any], ...] | None:
    if outputs is None:
        return None
    checked = tuple(outputs)
    for each in checked:
        if not isinstance(each, Output):
            raise TypeError(f"outputs must contain outputs of the plugin, got {each!r}")
    return checked


def when_due(hook: H) -> H:
    """Marks a hook that has nothing to do in steps in which no update is due.

    A decorator for `before_physics_step` and `after_physics_step`. The hook is called in every step
    unless `FlatlandPlugin.call_when_due` restricts its calls. If a subclass overrides the hook
    without this mark, its hook is called in every step.
    """
    setattr(hook, _MARK, True)
    return hook


def is_called_when_due(hook: Callable[..., None]) -> bool:
    """Returns whether a hook is marked by `when_due`."""
    return getattr(hook, _MARK, False)
