"""Exceptions of plugins, subscribers and observers: raised by `World.step`, or logged."""

from __future__ import annotations

import functools
import logging
import time
import types
from collections import Counter
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, get_args

from flatland.errors import PluginError
from flatland.foreign_texts import text_of
from flatland.plugin_api.ports import callback_name

if TYPE_CHECKING:
    from flatland.plugin_api.ports import Output

_LOG = logging.getLogger("flatland")

MAX_FAULTS: Final = 3
_LOG_PERIOD: Final = 1.0  # s of wall time between two tracebacks of one source

FaultPolicy = Literal["raise", "disable"]


class Faults:
    """The exceptions of code that is called by a world and is not part of it.

    No such exception interrupts a step: all other hooks, subscribers and observers are still
    called. With the policy `raise`, the first exception is kept, and `World.step` raises it when
    the step is complete. With the policy `disable`, exceptions are logged, with one traceback a
    second and source at most, and a plugin is disabled after `MAX_FAULTS` exceptions of one of its
    functions in a row.

    Attributes:
        first: The exception that `raise_first` raises, None if there is none.
        counts: Exceptions in a row of each (plugin, function) whose last call raised; see
            `add_of_plugin`.
    """

    outside_state: ClassVar[dict[str, Callable[[], object]]] = {
        "first": lambda: None,
        "_last_log": dict,
    }

    def __init__(self, policy: FaultPolicy) -> None:
        """Creates an empty record.

        Raises:
            ValueError: The policy is unknown.
        """
        if policy not in get_args(FaultPolicy):
            raise ValueError(f"plugin_errors must be 'raise' or 'disable', got {policy!r}")
        self._raises = policy == "raise"
        self.first: BaseException | None = None
        self.counts: Counter[Hashable] = Counter()
        self._last_log: dict[Hashable, float] = {}

    def add(self, source: Hashable, what: str, error: BaseException) -> None:
        """Records or logs an exception; to be called while the exception is handled.

        Args:
            source: Identifies the source, for the limit of the log.
            what: What raised, for the log, such as `subscriber f of output "/scan"`.
            error: The exception.
        """
        if self._raises:
            if self.first is None:
                self.first = _raisable(what, error)
            return
        now = time.monotonic()
        if now - self._last_log.get(source, -_LOG_PERIOD) >= _LOG_PERIOD:
            # Sources such as functions that are created anew must not accumulate.
            self._last_log = {
                other: last for other, last in self._last_log.items() if now - last < _LOG_PERIOD
            }
            self._last_log[source] = now
            _LOG.error("%s raised", what, exc_info=error)

    def add_of_plugin(
        self, plugin: Hashable, hook: str, source: Hashable, name: str, error: BaseException
    ) -> bool:
        """Records or logs an exception of a plugin; to be called while the exception is handled.

        Args:
            plugin: The plugin.
            hook: Name of the hook as part of which the function was called, for the log.
            source: What identifies the function among those of the plugin: the id of a job, the
                name of a hook, or the function itself.
            name: Description of the plugin, for the log.
            error: The exception.

        Returns:
            Whether the plugin is to be disabled.
        """
        self.add(plugin, f"{name}: {hook}", error)
        if self._raises:
            return False
        key = plugin, _identity(source)
        self.counts[key] += 1
        if self.counts[key] < MAX_FAULTS:
            return False
        _LOG.error(
            "%s: %s raised %d times in a row, the plugin is disabled", name, hook, MAX_FAULTS
        )
        return True

    def add_of_subscriber(
        self, output: Output[Any], callback: Callable[[Any], None], error: BaseException
    ) -> None:
        """Records or logs an exception of a subscriber; to be called while it is handled."""
        name = callback_name(callback)
        self.add(_identity(callback), f'subscriber {name} of output "{output.topic}"', error)

    def succeeded(self, plugin: Hashable, source: Hashable) -> None:
        """Resets the count of a function that returned; see `add_of_plugin`."""
        self.counts.pop((plugin, _identity(source)), None)

    def forget(self, plugins: set[Hashable]) -> None:
        """Drops the records of plugins that no longer exist."""
        for records in (self.counts, self._last_log):
            for key in list(records):
                if key in plugins or (isinstance(key, tuple) and key[0] in plugins):
                    del records[key]

    def raise_first(self) -> None:
        """Raises the first exception taken since the last call, if there is one."""
        if self.first is not None:
            error, self.first = self.first, None
            raise error


def _identity(source: Hashable) -> Hashable:
    """Returns what is equal for two calls of one function, even if the object is created anew.

    A lambda or a local function is identified by its code.
    """
    while isinstance(source, functools.partial):
        source = source.func
    if isinstance(source, int | str | tuple | types.MethodType):
        return source
    return getattr(source, "__code__", type(source))


def _raisable(what: str, error: BaseException) -> BaseException:
    """Returns the exception to raise, which names its source."""
    if isinstance(error, SystemExit):
        # A plugin must not end the program.
        fault = PluginError(f"{what} raised SystemExit({text_of(error.code, repr)})")
        fault.__cause__ = error
        return fault
    error.add_note(f"raised by {what}")
    return error
