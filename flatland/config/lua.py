"""Sandboxed evaluation of the Lua expressions of `$eval`.

World and model files can come from untrusted sources, and `$eval` is a program. Therefore each
expression is evaluated in a separate Lua state that contains no Python objects: input is passed as
plain values, and the result is returned as text. If the expression reads a parameter whose value
has not been passed, the run ends, the value is looked up, and the expression is evaluated again.
Time and memory are bounded.
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
"""Limit of the processor time of an expression [s]."""
MEMORY_LIMIT = 16 * 1024 * 1024
"""Limit of the memory of an expression [bytes]."""
# Far below the memory limit, because the input is copied into the state without protection [bytes].
_MAX_INPUT = 1024 * 1024
_MAX_RUNS = 200

# The lupa package of Debian contains only LuaJIT; others contain several versions of Lua.
_RUNTIMES = ("lupa.lua51", "lupa.luajit21", "lupa.luajit20", "lupa")


class EvalError(Exception):
    """The evaluation of an expression failed; the text is the Lua error message.

    Attributes:
        printed: As in `EvalResult`.
    """

    def __init__(self, message: str, printed: str = "") -> None:
        """Initializes the error."""
        super().__init__(message)
        self.printed = printed


@dataclass(frozen=True, slots=True)
class EvalResult:
    """Result of an expression.

    Attributes:
        text: The value as converted by `tostring` of Lua, empty for nil.
        unset: Unset variables and parameters that were read without a default, such as
            `env "HOME"`.
        printed: What `print` was called with, at most 2000 bytes.
    """

    text: str
    unset: tuple[str, ...]
    printed: str


def evaluate(expression: str, param: Callable[[str], object], seed: int = 0) -> EvalResult:
    """Evaluates an expression in a fresh Lua 5.1 state.

    Args:
        expression: Lua code; without a `return `, it is the expression of the value.
        param: Function that returns the value of a ROS parameter: a number, a string or a bool;
            None for a parameter that is not set.
        seed: Seed of `math.random`, at least 0.

    Raises:
        EvalError: The expression is not valid Lua, fails, exceeds the limit of time or memory, or
            its value is not nil, a boolean, a number or a string.
    """
    code = expression if "return " in expression else "return " + expression
    params: list[object] = []
    spent = 0.0
    for _ in range(_MAX_RUNS):
        start = time.process_time()
        status, *rest = _run(code, params, spent, seed)
        spent += time.process_time() - start
        if status == b"param":
            name = _decode(rest[0])
            params += [rest[0], _lua_value(name, param(name))]
            continue
        text, printed, *unset = rest
        shown = printed.decode(errors="replace")
        if status == b"error":
            raise EvalError(_decode(text), shown)
        return EvalResult(_decode(text), tuple(map(_decode, unset)), shown)
    raise EvalError(f"more than {_MAX_RUNS} parameters are read")


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


def _run(code: str, params: list[object], spent: float, seed: int) -> tuple[bytes, ...]:
    source = code.encode()
    size = len(source) + sum(len(value) for value in params if isinstance(value, bytes))
    if size > _MAX_INPUT:
        raise EvalError(f"the expression and its parameters exceed {_MAX_INPUT} bytes")
    new_state, interval = _state_factory()
    try:
        result: tuple[bytes, ...] = new_state().execute(
            _sandbox(), source, spent, TIME_LIMIT, MEMORY_LIMIT, interval, seed, *params
        )
        return result
    except MemoryError:
        raise EvalError("not enough memory") from None
    except Exception as error:
        raise EvalError(str(error).partition("\nstack traceback:")[0]) from error


@functools.cache
def _sandbox() -> bytes:
    """Returns the Lua program that sets up the sandbox and runs an expression."""
    return (importlib.resources.files("flatland.config") / "sandbox.lua").read_bytes()


@functools.cache
def _state_factory() -> tuple[Callable[[], Any], int]:
    """Returns the constructor of Lua states and the number of instructions between two checks."""
    options = {"encoding": None, "register_eval": False, "attribute_filter": _refuse}
    more_options = {"register_builtins": False, "max_memory": MEMORY_LIMIT}
    for name in _RUNTIMES:
        runtime = _find_runtime(name)
        if runtime is None:
            continue
        try:
            runtime(**options, **more_options)
        except Exception:
            # An older lupa, or LuaJIT, cannot limit the memory itself: check more often.
            return functools.partial(runtime, **options), 10
        return functools.partial(runtime, **options, **more_options), 100
    raise EvalError("the Python package lupa with Lua 5.1 or LuaJIT is required")


def _find_runtime(name: str) -> Any:
    """Returns the Lua 5.1 runtime class of a module, None if the module does not provide one."""
    try:
        runtime = importlib.import_module(name).LuaRuntime
    except ImportError:
        return None
    return runtime if runtime().lua_version == (5, 1) else None


def _refuse(_object: object, name: object, _is_setting: bool) -> NoReturn:
    raise AttributeError(f"access to {name!r} is denied")
