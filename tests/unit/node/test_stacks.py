"""Descriptions of what a thread executes."""

from __future__ import annotations

import sys
from pathlib import Path
from types import FrameType

from flatland import ModelPlugin
from flatland.node.stacks import call_name, describe_stack, plugin_call

FILE = str(Path(__file__))


def here() -> FrameType:
    return sys._getframe(1)


def deep(depth: int) -> FrameType:
    return deep(depth - 1) if depth else here()


class Looping(ModelPlugin):
    """A plugin that is not part of a world, and therefore has no name."""

    def hook(self) -> FrameType:
        return self.inner()

    def inner(self) -> FrameType:
        return deep(0)


def test_the_innermost_calls_are_described_the_last_one_at_the_end() -> None:
    frame = deep(12)
    calls = describe_stack(frame).split(" > ")
    assert len(calls) == 10
    assert all(call.startswith(f"{FILE}:") and call.endswith(" in deep") for call in calls)
    assert plugin_call(frame) is None
    outer, inner = describe_stack(deep(0)).split(" > ")[-2:]
    assert outer.endswith("in test_the_innermost_calls_are_described_the_last_one_at_the_end")
    assert inner.endswith("in deep")


def test_in_a_plugin_the_calls_begin_with_its_method() -> None:
    frame = Looping().hook()
    text = describe_stack(frame)
    assert text.startswith(f"Looping: hook, {FILE}:")
    assert [call.rpartition(" in ")[2] for call in text.split(" > ")] == ["hook", "inner", "deep"]
    call = plugin_call(frame)
    assert call is not None
    assert call_name(*call) == "Looping: hook"
