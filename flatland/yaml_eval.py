"""Evaluates the Lua of `$eval` in a sandbox.

World and model files come from strangers too, and `$eval` is a program. So each expression gets
a Lua state of its own that holds no Python object at all: what it needs goes in as plain values,
its result comes out as text. A parameter that it asks for and does not have yet ends the run; it
is looked up and the expression starts again. Time and memory are bounded.
"""

from __future__ import annotations

import functools
import importlib
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
            _SANDBOX, source, spent, TIME_LIMIT, MEMORY_LIMIT, interval, *params
        )
        return result
    except MemoryError:
        raise EvalError("not enough memory") from None
    except Exception as error:
        raise EvalError(str(error).partition("\nstack traceback:")[0]) from error


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


# Runs once in each state, as its only chunk. All that the guards use is in locals, so that the
# expression can neither see nor change it, whatever it does to the globals.
_SANDBOX = rb"""
local code, spent, time_limit, memory_limit, interval = ...
local error, ipairs, pairs, pcall, select, tonumber, tostring, type, unpack =
  error, ipairs, pairs, pcall, select, tonumber, tostring, type, unpack
local clock, getenv, sethook, memory_used = os.clock, os.getenv, debug.sethook, collectgarbage
local loadstring, create, resume = loadstring, coroutine.create, coroutine.resume
local byte, find, gsub, rep, sort = string.byte, string.find, string.gsub, string.rep, table.sort
local concat, insert = table.concat, table.insert

local known = {}  -- parameters: a table with the value, or with nothing for one that is unset
local given = {select(6, ...)}
for i = 1, select("#", ...) - 5, 2 do known[given[i]] = {given[i + 1]} end

if jit then jit.off() end  -- compiled code calls no hooks
for _, name in ipairs{"execute", "exit", "remove", "rename", "tmpname", "setlocale"} do
  os[name] = nil
end
for name in pairs(package.loaded) do package.loaded[name] = nil end
-- newproxy makes finalizers, and those run without hooks
for _, name in ipairs{"io", "package", "require", "module", "dofile", "loadfile", "debug",
                      "python", "newproxy", "jit", "ffi"} do
  _G[name] = nil
end

-- Stopping: once `stopped` is set, nothing that catches errors lets the expression run on.
local stopped, wanted
local start = clock() - spent
local check
function check()
  if not stopped and clock() - start > time_limit then
    stopped = "it runs for more than " .. time_limit .. " s"
  elseif not stopped and memory_used("count") * 1024 > memory_limit then
    stopped = "not enough memory"
  end
  if stopped then
    sethook(check, "", interval)  -- LuaJIT does not count anew after an error
    error(stopped, 0)
  end
end
local function pass(...)
  if stopped then error(stopped, 0) end
  return ...
end

function _G.pcall(...) return pass(pcall(...)) end
-- Lua's own calls the handler inside of the hook that has failed, where no hook stops it.
function _G.xpcall(run, handler)
  local function finish(ok, ...)
    if ok then return true, ... end
    return false, select(2, pass(pcall(handler, ...)))
  end
  return finish(pass(pcall(run)))
end
function coroutine.create(run)
  local thread = create(run)
  sethook(thread, check, "", interval)  -- each coroutine has its own
  return thread
end
local create_hooked = coroutine.create
function coroutine.resume(...) return pass(resume(...)) end
function coroutine.wrap(run)
  local thread = create_hooked(run)
  local function finish(ok, ...)
    if not ok then error((...), 0) end
    return ...
  end
  return function(...) return finish(pass(resume(thread, ...))) end
end

-- Text only: a forged binary chunk can do anything to the process.
function _G.loadstring(text, name)
  check()
  if type(text) == "string" and byte(text, 1) == 27 then
    return nil, "binary chunks are refused"
  end
  return loadstring(text, name)
end
local load_text = _G.loadstring
function _G.load(reader, name)
  if type(reader) == "string" then return load_text(reader, name) end
  local pieces = {}
  while true do
    local piece = reader()
    if piece == nil or piece == "" then break end
    pieces[#pieces + 1] = piece
  end
  return load_text(concat(pieces), name or "=(load)")
end

-- One call of these may work for ever, and no hook comes in between: the cost is bounded first.
local function limit(steps, what)
  check()
  if steps > 2e8 then error(what, 3) end  -- about 1 s
end
-- not tostring: the expression may have changed what that makes of strings
local function text_of(value)
  local kind = type(value)
  return kind == "string" and value or kind == "number" and tostring(value) or ""
end
local function guard(name, plain_allowed)
  local run = string[name]
  string[name] = function(text, pattern, third, plain)
    local n, m = #text_of(text), #text_of(pattern)
    if plain_allowed and plain then
      limit(n * m / 16, "the text to find is too long")
    else
      if m > 1000 then error("the pattern has more than 1000 characters", 2) end
      -- %b and %1 go through the text too; sets are single characters
      local bare = gsub(gsub(text_of(pattern), "%%[b%d]", "x*"), "%%.", "x")
      bare = gsub(bare, "%[%^?.[^%]]*%]", "x")
      local _, many = gsub(bare, "[*+-]", "")
      local _, maybe = gsub(bare, "%?", "")
      local steps = (byte(bare, 1) == 94 and 1 or n + 1) * 2 ^ maybe * (1 + #bare / 8)
      for i = 1, many do steps = steps * (n + i) / i end
      limit(steps, "the pattern may take too long for a text of " .. n .. " characters")
    end
    if name == "gsub" and (n + 1) * #text_of(third) > memory_limit then
      error("not enough memory", 2)
    end
    return run(text, pattern, third, plain)
  end
end
guard("find", true) guard("match") guard("gmatch") guard("gsub")
string.gfind = nil
function string.rep(text, count)
  local size = #text_of(text)
  if size == 0 then return "" end
  if (tonumber(count) or 0) * size > memory_limit then error("not enough memory", 2) end
  return rep(text, count)
end
local function is_index(number) return number > -1e9 and number < 1e9 end
function _G.unpack(list, first, last)
  first, last = tonumber(first) or 1, last == nil and #list or tonumber(last) or 0
  -- Lua 5.1 counts with 32 bits here; where that overflows, it crashes
  if not (is_index(first) and is_index(last) and last - first < 7000) then
    error("too many results to unpack", 2)
  end
  return unpack(list, first, last)
end
function table.insert(list, ...)
  local position = tonumber((...)) or 0
  if select("#", ...) > 1 and not (position >= 0 and is_index(position)) then
    error("position out of bounds", 2)
  end
  return insert(list, ...)
end
function table.sort(list, less)
  return sort(list, less or function(a, b) return a < b end)  -- a Lua function lets hooks in
end

local unset, seen = {}, {}
local function bind(kind, read)
  _G[kind] = function(name, default)
    if type(name) ~= "string" then
      error(kind .. " needs a name, got " .. type(name), 2)
    end
    local value = read(name)
    if value ~= nil then return value end
    local label = kind .. ' "' .. name .. '"'
    if default == nil and not seen[label] and #unset < 20 then
      seen[label] = true
      unset[#unset + 1] = label
    end
    return default
  end
end
bind("env", function(name)
  local text = getenv(name)
  return text and find(text, "^[+-]?[%d.][%d.eE+-]*$") and tonumber(text) or text
end)
bind("param", function(name)
  if not known[name] then
    wanted = name
    stopped = "parameter"  -- a hook may come in between
    error(stopped, 0)
  end
  return known[name][1]
end)

local chunk, value = load_text(code, "=$eval")
local ok = false
if chunk then
  -- a hook that comes right after the expression fails in `attempt`, not here
  local function attempt()
    ok, value = pcall(chunk)
    sethook()
  end
  sethook(check, "", interval)
  pcall(attempt)
  sethook()
end
if wanted then return "param", wanted end
if stopped then return "error", stopped end
local kind = type(value)
if kind == "nil" and ok then return "value", "", unpack(unset) end
if value ~= value then value = "nan" end  -- Lua 5.1 adds a sign, LuaJIT does not
if kind == "boolean" then value = value and "true" or "false" end
if kind == "string" or kind == "number" or kind == "boolean" then
  return ok and "value" or "error", text_of(value), unpack(unset)
end
return "error", ok and "the result is a " .. kind .. ", not a value" or "error of type " .. kind
"""
