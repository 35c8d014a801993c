"""The parameter `after_step`: publishing the state after a step instead of that before it.

By default, plugins that publish in `before_physics_step` publish the state at time t, when the node
has published the time t already. With `after_step: true`, they publish the state at time t + dt in
`after_physics_step`. The times at which updates are due are the same, except that the state at time
0, which no step precedes, is published only if the rate is 0, that is, if it is the only update.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from flatland.plugin_api.schedule import not_called
from flatland.plugin_api.update_timer import UpdateClock, UpdateTimer
from flatland.timekeeper import Timekeeper

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.plugin_api.plugin import FlatlandPlugin

StepHook = Callable[[Timekeeper], None]

BEFORE: Final = "before_physics_step"
AFTER: Final = "after_physics_step"


def read_after_step(config: YamlReader) -> bool:
    """Reads the parameter `after_step`.

    Raises:
        YamlError: The value is not a boolean.
    """
    return config.get("after_step", "bool", False)


def call_after_step(plugin: FlatlandPlugin, hook: StepHook) -> None:
    """Makes a function the hook `after_physics_step` of one plugin; to be called when it starts.

    Other plugins of the class remain without this hook, so that it costs nothing for them.
    """
    vars(plugin)[AFTER] = hook


def update_after_step(plugin: FlatlandPlugin, config: YamlReader, timer: UpdateTimer) -> str:
    """Calls `before_physics_step` of a plugin after the step instead, if `after_step` is set.

    To be called in `on_initialize`.

    Args:
        plugin: A plugin whose `before_physics_step` only publishes.
        config: Parameters of the plugin.
        timer: Timer of its updates.

    Returns:
        Name of the hook that publishes.

    Raises:
        YamlError: The value is not a boolean.
    """
    if read_after_step(config) and timer.rate:
        call_after_step(plugin, plugin.before_physics_step)
        vars(plugin)[BEFORE] = not_called
        return AFTER
    return BEFORE


class NeverDue(UpdateTimer):
    """The timer of a hook that does not publish."""

    __slots__ = ()

    def clock(self, step_size_ns: int) -> UpdateClock | None:
        """Returns the clock that is never due."""
        del step_size_ns
        return ("never", 0, 0)

    def check_update(self, timekeeper: Timekeeper) -> bool:
        """Returns False."""
        del timekeeper
        return False
