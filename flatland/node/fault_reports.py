"""Reports of faults that Python does not pass to the code of the node: threads, crashes."""

from __future__ import annotations

import faulthandler
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING

from flatland.node.stacks import plugin_name, plugin_of

if TYPE_CHECKING:
    from flatland.plugin_api.plugin import FlatlandPlugin
    from flatland.world import World

_LOG = logging.getLogger("flatland")


class FaultReports:
    """Logs exceptions that end a thread, and prints the Python stacks when the process crashes.

    Attributes:
        world: The world whose plugins are searched for the origin of an exception; None before it
            is loaded.
    """

    def __init__(self, is_fault_of_client: Callable[[type[BaseException]], bool]) -> None:
        """Creates reports that are not installed.

        Args:
            is_fault_of_client: Returns whether an exception of a type ends the thread of a client
                of the node that has sent invalid data.
        """
        self._is_fault_of_client = is_fault_of_client
        self.world: World | None = None

    def install(self) -> None:
        """Installs the reports for the process."""
        # On a segmentation fault, an abort and the like: the stack of each thread, with the files,
        # lines and functions of the plugin that was running. Nothing else can be called then.
        faulthandler.enable()
        threading.excepthook = self._log

    def _log(self, ended: threading.ExceptHookArgs) -> None:
        if ended.exc_type is SystemExit:
            return
        if self._is_fault_of_client(ended.exc_type):
            _LOG.warning("closed the connection of a client: %s", ended.exc_value)
            return
        name = "unknown" if ended.thread is None else ended.thread.name
        plugin = self._origin(ended.exc_traceback)
        _LOG.error(
            'thread "%s"%s ended with an exception',
            name,
            f" of {plugin}" if plugin else "",
            exc_info=(ended.exc_type, ended.exc_value or ended.exc_type(), ended.exc_traceback),
        )

    def _origin(self, traceback: TracebackType | None) -> str:
        """Describes the plugin in whose code an exception was raised; empty if it is unknown."""
        files = []
        while traceback is not None:
            plugin = plugin_of(traceback.tb_frame)
            if plugin is not None:
                return plugin_name(plugin)
            files.append(traceback.tb_frame.f_code.co_filename)
            traceback = traceback.tb_next
        found = [plugin for plugin in self._plugins() if _source_file(plugin) in files]
        return " or ".join(map(plugin_name, found))

    def _plugins(self) -> Iterator[FlatlandPlugin]:
        if self.world is not None:
            yield from self.world.plugin_host.world_plugins
            for model in self.world.models:
                yield from model.plugins


def _source_file(plugin: FlatlandPlugin) -> str | None:
    module = sys.modules.get(type(plugin).__module__)
    return getattr(module, "__file__", None)
