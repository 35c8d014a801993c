"""The calls that a thread executes, and the plugin that is called."""

from __future__ import annotations

import sys
from types import FrameType
from typing import TYPE_CHECKING, Final, TypeGuard

if TYPE_CHECKING:
    from flatland.plugin_api.plugin import FlatlandPlugin

_STACK_DEPTH: Final = 10  # calls shown of a stack


def describe_stack(frame: FrameType) -> str:
    """Describes a stack in one line.

    Args:
        frame: Innermost frame.

    Returns:
        The innermost calls with file, line and function, the last one made at the end; in code of
        a plugin, preceded by the plugin and its method, and only the calls from there on.
    """
    call = plugin_call(frame)
    first = None if call is None else call[1]
    calls: list[str] = []
    current: FrameType | None = frame
    while current is not None:
        code = current.f_code
        calls.append(f"{code.co_filename}:{current.f_lineno} in {code.co_name}")
        if current is first:
            break
        current = current.f_back
    text = " > ".join(reversed(calls[:_STACK_DEPTH]))
    return text if call is None else f"{call_name(*call)}, {text}"


def plugin_call(frame: FrameType) -> tuple[FlatlandPlugin, FrameType] | None:
    """Finds the outermost call of a method of a plugin: a hook or a callback.

    Args:
        frame: Innermost frame of a thread.

    Returns:
        The plugin and the frame of its method; None if the thread executes no code of a plugin.
    """
    found = None
    current: FrameType | None = frame
    while current is not None:
        plugin = plugin_of(current)
        if plugin is not None:
            found = plugin, current
        current = current.f_back
    return found


def plugin_of(frame: FrameType) -> FlatlandPlugin | None:
    """Returns the plugin whose method a frame executes, None for other functions."""
    owner = frame.f_locals.get("self") if "self" in frame.f_code.co_varnames else None
    return owner if _is_plugin(owner) else None


def _is_plugin(owner: object) -> TypeGuard[FlatlandPlugin]:
    # The node imports the module late, and until then there are no plugins.
    module = sys.modules.get("flatland.plugin_api.plugin")
    return isinstance(owner, getattr(module, "FlatlandPlugin", ()))


def call_name(plugin: FlatlandPlugin, frame: FrameType) -> str:
    """Returns the description of a plugin with the name of its method."""
    return f"{plugin_name(plugin)}: {frame.f_code.co_name}"


def plugin_name(plugin: FlatlandPlugin) -> str:
    """Returns the description of a plugin, also of one that has no name yet."""
    from flatland.plugin_api.plugin import describe  # imported, since there is a plugin

    try:
        return describe(plugin)
    except AttributeError:  # A plugin has no name or model before it is attached to a world.
        return type(plugin).__qualname__
