"""Hooks that are called only in steps in which an update is due, so that other steps are cheap."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

if TYPE_CHECKING:
    from flatland.entities.body import Body
    from flatland.geometry import Pose
    from flatland.physics import Touches
    from flatland.plugin_api.ports import Output
    from flatland.plugin_api.update_timer import UpdateTimer
    from flatland.timekeeper import Timekeeper

H = TypeVar("H", bound=Callable[..., None])

SkippedHandler = Callable[[int, int, "tuple[Pose, ...]"], None]
"""Called as `handler(count, stamp, poses)`, see `FlatlandPlugin.call_when_due`."""

_MARK: Final = "_flatland_when_due"
_BATCH: Final = "_flatland_batch"


@dataclass(frozen=True, slots=True)
class HookSchedule:
    """When a hook of a plugin is to be called; see `FlatlandPlugin.call_when_due`.

    Attributes:
        timer: Timer of the updates.
        outputs: Outputs that the hook computes, None if it is always called.
        transforms: Whether the hook sends transforms.
        bodies: Bodies whose poses `skipped` needs.
        skipped: Accounts for updates without a call.
        touches: Contacts that are to be cleared at updates without a call, and after whose steps
            the hook is called if `calls_at_touches` is set.
        calls_at_touches: Whether to call the hook also in steps with contacts.
    """

    timer: UpdateTimer
    outputs: tuple[Output[Any], ...] | None
    transforms: bool
    bodies: tuple[Body, ...]
    skipped: SkippedHandler | None
    touches: Touches | None
    calls_at_touches: bool


def when_due(hook: H) -> H:
    """Marks a hook that has nothing to do in steps in which no update is due.

    A decorator for `before_physics_step` and `after_physics_step`. The hook is called in every step
    unless `FlatlandPlugin.call_when_due` restricts its calls. If a subclass overrides the hook
    without this mark, its hook is called in every step.
    """
    setattr(hook, _MARK, True)
    return hook


class HookBatch(NamedTuple):
    """The parts of a hook that serves consecutive plugins of a step together.

    A step calls `begin` of all plugins, then `perform` once with those for which it returned true,
    then `finish` of each of these. The parts must not move bodies.

    Attributes:
        begin: Name of the method `begin(timekeeper)`.
        perform: Function of a sequence of plugins, of one or several models. If it raises, it has
            done nothing.
        finish: Name of the method `finish(timekeeper)`.
    """

    begin: str
    perform: Callable[[Sequence[Any]], object]
    finish: str


def in_batches(hook: Callable[..., None], batch: HookBatch) -> None:
    """Allows steps to call the parts of a hook instead of the hook itself."""
    setattr(hook, _BATCH, batch)


def batch_of(hook: Callable[..., None]) -> HookBatch | None:
    """Returns the parts of a hook, None if it is called as a whole."""
    found: HookBatch | None = getattr(hook, _BATCH, None)
    return found


def is_called_when_due(hook: Callable[..., None]) -> bool:
    """Returns whether a hook is marked by `when_due`."""
    return getattr(hook, _MARK, False)


@when_due
def not_called(timekeeper: Timekeeper) -> None:
    """Hook of a plugin whose work was moved to another hook."""
    del timekeeper
