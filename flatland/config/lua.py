"""Evaluates the Lua of `$eval` in a sandbox.

World and model files come from strangers too, and `$eval` is a program. So each expression gets
a Lua state of its own that holds no Python object at all: what it needs goes in as plain values,
its result comes out as text. A parameter that it asks for and does not have yet ends the run; it
is looked up and the expression starts again. Time and memory are bounded.
"""

from __future__ import annotations

import functools
import importlib
import importlib.resources
import time
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import Any, NoReturn

TIME_LIMIT = 1.0
"""Processor time that an expression may take [s]."""
MEMORY_LIMIT = 16 * 1024 * 1024
"""Memory that an expression may use [bytes]."""
_MAX_INPUT = 1024 * 1024  # pushed into the state outside of any protection, so far below the limit
_MAX_RUNS = 200

# Debian's lupa has a single runtime, LuaJIT; the others have Lua 5.1 and more.
_RUNTIMES = ("lupa.lua51", "lupa.luajit21", "lupa.luajit20", "lupa")


class EvalError(Exception):
    """An expression that failed; the text is Lua's message."""


@dataclass(frozen=True, slots=True)
class EvalResult:
    """What an expression gave.

    Attributes:
        text: The value in Lua's `tostring` form, empty for nil.
        unset: What it asked for without a default and is not set, such as `env "HOME"`.
    """

    text: str
    unset: tuple[str, ...]


def evaluate(expression: str, param: Callable[[str], object]) -> EvalResult:
    """Evaluates an expression in a fresh Lua 5.1 state.

    Args:
        expression: Lua; without a `return ` it is taken for the value itself.
        param: Value of a ROS parameter by its name: number, string, bool, or None if unset.

    Raises:
        EvalError: It is no Lua, fails, takes too long or too much memory, or its value is not
            nil, a boolean, a number or a string.
    """
    code = expression if "return " in expression else "return " + expression
    params: list[object] = []
    spent = 0.0
    for _ in range(_MAX_RUNS):
        start = time.process_time()
        status, *rest = _run(code, params, spent)
        spent += time.process_time() - start
        texts = [_decode(text) for text in rest]
        if status == b"value":
            return EvalResult(texts[0], tuple(texts[1:]))
        if status == b"error":
            raise EvalError(texts[0])
        params += [rest[0], _lua_value(texts[0], param(texts[0]))]
    raise EvalError(f"asks for more than {_MAX_RUNS} parameters")


def _lua_value(name: str, value: object) -> object:
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            raise EvalError(f'param "{name}" is too large for a Lua number') from None
    if isinstance(value, str):
        return value.encode(errors="replace")
    raise EvalError(
        f'param "{name}" must be a number, a string or a bool, got {type(value).__name__}'
    )


def _decode(text: bytes) -> str:
    try:
        return text.decode()
    except UnicodeDecodeError:
        raise EvalError(f"{text[:40]!r} is not UTF-8 text") from None


def _run(code: str, params: list[object], spent: float) -> tuple[bytes, ...]:
    source = code.encode()
    size = len(source) + sum(len(value) for value in params if isinstance(value, bytes))
    if size > _MAX_INPUT:
        raise EvalError(f"the expression and its parameters have more than {_MAX_INPUT} bytes")
    new_state, interval = _state_factory()
    try:
        result: tuple[bytes, ...] = new_state().execute(
            _sandbox(), source, spent, TIME_LIMIT, MEMORY_LIMIT, interval, *params
        )
        return result
    except MemoryError:
        raise EvalError("not enough memory") from None
    except Exception as error:
        raise EvalError(str(error).partition("\nstack traceback:")[0]) from error


@functools.cache
def _sandbox() -> bytes:
    """Returns the Lua program that guards and runs an expression."""
    return (importlib.resources.files("flatland.config") / "sandbox.lua").read_bytes()


@functools.cache
def _state_factory() -> tuple[Callable[[], Any], int]:
    """Finds a Lua, and how many of its instructions may pass between two checks."""
    options = {"encoding": None, "register_eval": False, "attribute_filter": _refuse}
    more_options = {"register_builtins": False, "max_memory": MEMORY_LIMIT}
    for name in _RUNTIMES:
        runtime = _find_runtime(name)
        if runtime is None:
            continue
        try:
            runtime(**options, **more_options)
        except Exception:
            # An older lupa or LuaJIT, without a bound of its own on the memory: check more often.
            return functools.partial(runtime, **options), 10
        return functools.partial(runtime, **options, **more_options), 100
    raise EvalError("it needs the Python package lupa with Lua 5.1 or LuaJIT")


def _find_runtime(name: str) -> Any:
    """Returns the class of a Lua 5.1 by its module, None if there is none."""
    try:
        runtime = importlib.import_module(name).LuaRuntime
    except ImportError:
        return None
    return runtime if runtime().lua_version == (5, 1) else None


def _refuse(_object: object, name: object, _is_setting: bool) -> NoReturn:
    raise AttributeError(f"access to {name!r} is refused")
