"""What a world tells those who connect it to something outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.plugin_api.plugin import FlatlandPlugin
    from flatland.plugin_api.ports import Command, Output
    from flatland.values import Transform


class WorldObserver:
    """Hears of all that happens to a world; each method does nothing until it is overridden.

    All methods are called in the thread that loads or steps the world. The simulation does not
    know what an observer does with it; the ROS bridge is one.
    """

    def output_opened(self, output: Output[Any]) -> None:
        """A plugin declared an output; raising refuses it, and the plugin fails to load."""

    def output_closed(self, output: Output[Any]) -> None:
        """The last plugin that had an output is gone."""

    def command_opened(self, command: Command[Any]) -> None:
        """A plugin declared a command; raising refuses it, and the plugin fails to load."""

    def command_closed(self, command: Command[Any]) -> None:
        """The plugin that had a command is gone."""

    def model_added(self, model: Model) -> None:
        """A model is complete and in the world."""

    def model_moved(self, model: Model) -> None:
        """A model was put elsewhere by a request."""

    def model_removed(self, model: Model) -> None:
        """A model is gone from the world."""

    def layer_changed(self, layer_name: str) -> None:
        """The edges of a layer changed, or it is new."""

    def time_advanced(self, time_ns: int) -> None:
        """The simulated time [ns] moved on; after-step hooks have not run yet."""

    @property
    def wants_transforms(self) -> bool:
        """Whether `transforms_sent` is worth a call in this step."""
        return True

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """All transforms of one step."""

    def plugin_ros(self, plugin: FlatlandPlugin) -> Any:
        """Gives what a plugin finds as `self.ros`; None when this observer has nothing."""
        return None
