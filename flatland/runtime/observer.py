"""Observers: what connects a world to the outside without the world depending on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from flatland.errors import PLUGIN_FAULTS

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.plugin_api.plugin import FlatlandPlugin
    from flatland.plugin_api.ports import Command, Output, PortUser
    from flatland.runtime.faults import Faults
    from flatland.values import Transform


class WorldObserver:
    """Receives notifications of world events; each method does nothing unless overridden.

    All methods are called in the thread that loads or steps the world. An exception of a method is
    handled like an exception of a plugin (see `World`, argument `plugin_errors`), except in
    `output_opened` and `command_opened`, where an exception refuses the port.
    """

    def attached(self, world: Any) -> None:
        """The observer was added to a `flatland.World`; called before any other method."""

    def detached(self) -> None:
        """The observer was removed, or the world was closed; called after all other methods."""

    def output_opened(self, output: Output[Any]) -> None:
        """A plugin declares an output; if this raises, the plugin fails to load."""

    def output_closed(self, output: Output[Any]) -> None:
        """The last plugin that declared an output is gone."""

    def command_opened(self, command: Command[Any]) -> None:
        """A plugin declares a command; if this raises, the plugin fails to load."""

    def command_closed(self, command: Command[Any]) -> None:
        """The plugin that declared a command is gone."""

    def model_added(self, model: Model) -> None:
        """A model is complete and in the world."""

    def model_moved(self, model: Model) -> None:
        """A model was moved by a request."""

    def model_changed(self, model: Model) -> None:
        """The colour, layers or visibility of bodies of a model may have changed."""

    def model_removed(self, model: Model) -> None:
        """A model was removed from the world."""

    def layer_changed(self, layer_name: str) -> None:
        """A layer was added, or its edges changed."""

    def step_started(self) -> None:
        """A step starts; no hook has run yet."""

    def time_advanced(self, time_ns: int) -> None:
        """The simulated time [ns] advanced; hooks after the step have not run yet.

        Also called if `World.reset` or `World.restore` set it, to an earlier time as a rule.
        """

    @property
    def watches_steps(self) -> bool:
        """Whether the observer is to be notified of each step.

        Otherwise, `step_started`, `time_advanced` and `step_finished` may be called once for
        several steps in which no code of plugins is called, which are then much faster.
        """
        return True

    @property
    def watches_time(self) -> bool:
        """Whether another thread passes on the time while a `Simulation` waits between two steps.

        Otherwise, `time_advanced` may be called up to 25 ms of wall time late.
        """
        return False

    @property
    def wants_transforms(self) -> bool:
        """Whether `transforms_sent` is to be called in this step."""
        return True

    def transforms_sent(self, transforms: Sequence[Transform]) -> None:
        """All transforms of one step."""

    def step_finished(self) -> None:
        """A step ends: its hooks have run, and its transforms were sent; also if it failed."""

    def plugin_ros(self, plugin: FlatlandPlugin) -> Any:
        """Returns what a plugin gets as `self.ros`, None if this observer provides nothing."""
        return None


class Observers:
    """The observers of one world, notified in the order in which they were added.

    Attributes:
        is_notifying: Whether code of an observer runs.
        of_plugins: The observers that plugins have added, with the plugins. A clone has copies of
            them.
    """

    def __init__(self, faults: Faults) -> None:
        """Creates an empty list.

        Args:
            faults: Handles the exceptions of observers.
        """
        self._faults = faults
        self.is_notifying = False
        self.of_plugins: tuple[tuple[WorldObserver, PortUser], ...] = ()
        self._all: tuple[WorldObserver, ...] = ()
        # Notified in every step, so only those that override the method.
        self._of_time: tuple[WorldObserver, ...] = ()
        self._of_transforms: tuple[WorldObserver, ...] = ()
        self._of_start: tuple[WorldObserver, ...] = ()
        self._of_finish: tuple[WorldObserver, ...] = ()
        self._of_steps: tuple[WorldObserver, ...] = ()  # all of the four

    def add(self, observer: WorldObserver) -> None:
        """Adds an observer, which has been attached to the world."""
        self._set((*self._all, observer))

    def remove(self, observer: WorldObserver) -> None:
        """Removes an observer and detaches it.

        Raises:
            ValueError: The observer was not added, or has been removed.
        """
        if observer not in self._all:
            raise ValueError(f"{observer!r} is not an observer of this world")
        self.of_plugins = tuple(pair for pair in self.of_plugins if pair[0] is not observer)
        self._set(tuple(other for other in self._all if other is not observer))
        self._call(observer, "detached")

    def add_of_plugin(self, observer: WorldObserver, owner: PortUser) -> None:
        """Adds an observer that ends with a plugin; one that was added already is ignored."""
        if observer in self._all:
            return
        self.add(observer)
        self.of_plugins = (*self.of_plugins, (observer, owner))
        owner._call_at_end(lambda: self._end(observer))

    def _end(self, observer: WorldObserver) -> None:
        if observer in self._all:
            self.remove(observer)

    def remove_all(self) -> None:
        """Removes all observers, the last one first."""
        for observer in reversed(self._all):
            self.remove(observer)

    def _set(self, observers: tuple[WorldObserver, ...]) -> None:
        self._all = observers
        self._of_time = tuple(o for o in observers if _overrides(o, "time_advanced"))
        self._of_transforms = tuple(o for o in observers if _overrides(o, "transforms_sent"))
        self._of_start = tuple(o for o in observers if _overrides(o, "step_started"))
        self._of_finish = tuple(o for o in observers if _overrides(o, "step_finished"))
        of_any = (*self._of_time, *self._of_transforms, *self._of_start, *self._of_finish)
        self._of_steps = tuple(dict.fromkeys(of_any))

    # -- ports: an exception refuses the port ----------------------------------------------

    def output_opened(self, output: Output[Any]) -> None:
        """Notifies all observers; if one raises, notifies the ones before it of the end."""
        self._open(output, "output_opened", "output_closed")

    def output_closed(self, output: Output[Any]) -> None:
        """Notifies all observers."""
        self._notify("output_closed", output)

    def command_opened(self, command: Command[Any]) -> None:
        """Notifies all observers; if one raises, notifies the ones before it of the end."""
        self._open(command, "command_opened", "command_closed")

    def command_closed(self, command: Command[Any]) -> None:
        """Notifies all observers."""
        self._notify("command_closed", command)

    def _open(self, port: Output[Any] | Command[Any], opened: str, closed: str) -> None:
        for number, observer in enumerate(self._all):
            outer, self.is_notifying = self.is_notifying, True
            try:
                getattr(observer, opened)(port)
            except BaseException:
                for notified in self._all[:number]:
                    self._call(notified, closed, port)
                raise
            finally:
                self.is_notifying = outer

    # -- everything else: observers are contained ------------------------------------------

    def model_added(self, model: Model) -> None:
        """Notifies all observers."""
        self._notify("model_added", model)

    def model_moved(self, model: Model) -> None:
        """Notifies all observers."""
        self._notify("model_moved", model)

    def model_changed(self, model: Model) -> None:
        """Notifies all observers."""
        self._notify("model_changed", model)

    @property
    def watch_appearance(self) -> bool:
        """Whether an observer overrides `model_changed`."""
        return any(_overrides(observer, "model_changed") for observer in self._all)

    def model_removed(self, model: Model) -> None:
        """Notifies all observers."""
        self._notify("model_removed", model)

    def layer_changed(self, layer_name: str) -> None:
        """Notifies all observers."""
        self._notify("layer_changed", layer_name)

    @property
    def watch_any(self) -> bool:
        """Whether an observer is to be notified of steps, single or several at once."""
        return bool(self._of_steps)

    @property
    def watch_steps(self) -> bool:
        """Whether an observer is to be notified of each step."""
        # A generator expression takes longer than a short step.
        for observer in self._of_steps:
            try:
                if observer.watches_steps:
                    return True
            except PLUGIN_FAULTS as error:
                self._take(observer, "watches_steps", error)
        return False

    @property
    def watch_time(self) -> bool:
        """Whether an observer is to be notified of the time without delay."""
        for observer in self._of_time:
            try:
                if observer.watches_time:
                    return True
            except PLUGIN_FAULTS as error:
                self._take(observer, "watches_time", error)
        return False

    @property
    def want_transforms(self) -> bool:
        """Whether an observer wants the transforms of this step."""
        for observer in self._of_transforms:  # as for `watch_steps`
            try:
                if observer.wants_transforms:
                    return True
            except PLUGIN_FAULTS as error:
                self._take(observer, "wants_transforms", error)
        return False

    def step_started(self) -> None:
        """Notifies the observers that override the method."""
        for observer in self._of_start:
            self._call(observer, "step_started")

    def step_finished(self) -> None:
        """Notifies the observers that override the method."""
        for observer in self._of_finish:
            self._call(observer, "step_finished")

    def time_advanced(self, time_ns: int) -> None:
        """Notifies the observers that override the method."""
        for observer in self._of_time:
            self._call(observer, "time_advanced", time_ns)

    def transforms_sent(self, make_batch: Callable[[], Sequence[Transform]]) -> None:
        """Notifies the observers that want transforms.

        Args:
            make_batch: Returns the transforms; called at most once.
        """
        batch: Sequence[Transform] | None = None
        for observer in self._of_transforms:
            try:
                if not observer.wants_transforms:
                    continue
            except PLUGIN_FAULTS:
                continue  # It was recorded by `want_transforms`.
            if batch is None:
                batch = make_batch()
            self._call(observer, "transforms_sent", batch)

    def plugin_ros(self, plugin: FlatlandPlugin) -> Any:
        """Returns what the first observer that provides anything returns, None if none does."""
        for observer in self._all:
            ros = observer.plugin_ros(plugin)
            if ros is not None:
                return ros
        return None

    def _notify(self, method: str, argument: Any) -> None:
        for observer in self._all:
            self._call(observer, method, argument)

    def _call(self, observer: WorldObserver, method: str, *arguments: Any) -> None:
        outer, self.is_notifying = self.is_notifying, True
        try:
            getattr(observer, method)(*arguments)
        except PLUGIN_FAULTS as error:
            self._take(observer, method, error)
        finally:
            self.is_notifying = outer

    def _take(self, observer: WorldObserver, method: str, error: BaseException) -> None:
        what = f"observer {type(observer).__name__}: {method}"
        self._faults.add((id(observer), method), what, error)


def _overrides(observer: WorldObserver, method: str) -> bool:
    return getattr(type(observer), method) is not getattr(WorldObserver, method)
