"""The sandbox of `$eval`: isolation, and limits of time and memory."""

from __future__ import annotations

import gc
import json
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from programs import run_program

from flatland.config import lua
from flatland.config.lua import EvalError, evaluate


def run(code: str, params: dict[str, object] | None = None) -> str:
    return evaluate(code, (params or {}).get).text


def failure(code: str) -> str:
    with pytest.raises(EvalError) as caught:
        run(code)
    return str(caught.value)


@pytest.fixture(params=[name for name in lua._RUNTIMES if lua._find_runtime(name)])
def runtime(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Each Lua runtime of the installed lupa package."""
    monkeypatch.setattr(lua, "_RUNTIMES", (request.param,))
    lua._state_factory.cache_clear()
    yield request.param
    lua._state_factory.cache_clear()


REMOVED = [
    "os.execute", "os.exit", "os.remove", "os.rename", "os.tmpname", "os.setlocale", "io",
    "package", "require", "module", "dofile", "loadfile", "debug", "python", "newproxy", "jit",
    "ffi", "_G.io", "_G['python']", "getfenv(0).io", "getfenv(print).os.execute", "string.gfind",
    "getmetatable(env)", "getmetatable(param)", "getmetatable(print)", "rawget(_G, 'debug')",
]  # fmt: skip


KEPT = [
    "math.sin", "string.format", "table.concat", "os.time", "os.clock", "os.date", "os.getenv",
    "pairs", "ipairs", "pcall", "xpcall", "load", "loadstring", "setmetatable", "unpack",
    "coroutine.create", "tonumber", "env", "param",
]  # fmt: skip


def test_unsafe_functions_are_removed_and_others_are_kept(runtime: str) -> None:
    for names, expected in ((REMOVED, "nil"), (KEPT, "function")):
        kinds = " .. ' ' .. ".join(f"type({name})" for name in names)
        found = run(f"return {kinds}").split()
        wrong = {name: kind for name, kind in zip(names, found, strict=True) if kind != expected}
        assert wrong == {}, runtime


def test_no_python_object_is_reachable(runtime: str) -> None:
    """Visits everything reachable from an expression: tables, metatables, environments."""
    walk = r"""
        local seen, found = {}, {}
        local function visit(path, value)
          local kind = type(value)
          if kind == "userdata" or kind == "cdata" then found[#found + 1] = path end
          if seen[value] or (kind ~= "table" and kind ~= "function") then return end
          seen[value] = true
          local meta = getmetatable(value)
          if meta then visit(path .. ".meta", meta) end
          if kind == "function" then
            local ok, environment = pcall(getfenv, value)
            if ok then visit(path .. ".env", environment) end
          else
            for k, v in pairs(value) do visit(path .. "." .. tostring(k), v) end
          end
        end
        visit("_G", _G)
        visit("string", getmetatable(""))
        for level = 0, 20 do
          local ok, environment = pcall(getfenv, level)
          if ok then visit("level" .. level, environment) end
        end
        return table.concat(found, " ")
    """
    assert run(walk, {"a": 1}) == "", runtime


def test_loaded_code_runs_in_the_sandbox(runtime: str) -> None:
    for code in (
        "return loadstring('return io')()",
        "text = 'return io' return load(function() local s = text; text = nil; return s end)()",
        "return setfenv(loadstring('return io'), getfenv(0))()",
        "return coroutine.wrap(function() return io or debug or python end)()",
        "return select(2, pcall(function() return os.execute end))",
        "local t = setmetatable({}, {__index = _G}) return t.io",
    ):
        assert run(code) == "", (runtime, code)


def test_load_and_loadstring_evaluate_text(runtime: str) -> None:
    code = "local a = ('a'):upper() == 'A' and 2; return a + 1"
    assert run(code) == "3", runtime
    assert run(f'return loadstring("{code}")()') == "3", runtime
    pieces = "local i = 0 return load(function() i = i + 1 return ({[1]=%s})[i] end)()"
    assert run(pieces % f'"{code}"') == "3", runtime
    assert "near" in run("return select(2, loadstring('return +'))"), runtime
    assert "near" in run("return select(2, load(function() return nil end)) or 'near'")


def test_binary_chunks_are_not_allowed(runtime: str) -> None:
    for loader in (
        "loadstring(chunk)",
        "load(function() local c = chunk chunk = nil return c end)",
    ):
        code = f"chunk = string.dump(function() return 1 end) return select(2, {loader})"
        assert run(code) == "binary chunks are not allowed", runtime
    assert "binary chunks are not allowed" in failure("\x1bLua return ")


def test_guards_cannot_be_modified(runtime: str) -> None:
    code = """
        local setfenv, pcall, type = setfenv, pcall, type
        for _, library in ipairs{_G, string, table, coroutine} do
          for _, value in pairs(library) do
            if type(value) == "function" then pcall(setfenv, value, {}) end
          end
        end
        getmetatable("").__tostring = function() return "" end
        getmetatable("").__len = function() return 0 end
        tostring, type, error, select, pcall = nil, nil, nil, nil, nil
        return ("x"):rep(1e6):find(("x*"):rep(40) .. "y")
    """
    assert "may take too long" in failure(code), runtime


def test_the_result_does_not_depend_on_metatables(runtime: str) -> None:
    code = "getmetatable('').__tostring = function() return {} end return 'a'"
    assert run(code) == "a", runtime


ENDLESS = {
    "loop": "while true do end return 1",
    "goto loop": "repeat until false return 1",
    "loop in pcall": "return pcall(function() while true do end end)",
    "pcall in a loop": "while true do pcall(function() while true do end end) end return 1",
    "nested pcall": "return pcall(pcall, pcall, function() while true do end end)",
    "xpcall": "return xpcall(function() while true do end end, function() while true do end end)",
    "loop in a handler": "return xpcall(function() error() end, function() while true do end end)",
    "coroutine": "return coroutine.wrap(function() while true do end end)()",
    "resume in a loop": """while true do
        coroutine.resume(coroutine.create(function() while true do end end)) end return 1""",
    "coroutine in coroutine": """return coroutine.wrap(function()
        return coroutine.wrap(function() while true do end end)() end)()""",
    "yields": """local c = coroutine.wrap(function() while true do coroutine.yield() end end)
        while true do c() end return 1""",
    "metamethod": "return setmetatable({}, {__index = function() while true do end end}).x",
    "concat": "return setmetatable({}, {__concat = function() while true do end end}) .. ''",
    "sort": "return table.sort({1, 2, 3}, function() while true do end end)",
    "gsub": "return ('x'):gsub('x', function() while true do end end)",
    "loaded": "return loadstring('while true do end')()",
    "reader": "return load(function() return ' ' end)",
    "collector": "while true do collectgarbage() end return 1",
    "stopped collector": "collectgarbage('stop') while true do end return 1",
    "strings": "local s = ('x'):rep(4e6) while true do pcall(string.upper, s) end return 1",
    "patterns": "while true do pcall(string.find, ('x'):rep(200), 'x*x*y') end return 1",
}


@pytest.mark.parametrize("code", ENDLESS.values(), ids=ENDLESS)
def test_endless_expressions_are_stopped(
    runtime: str, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lua, "TIME_LIMIT", 0.01)
    assert failure(code) in ("the time limit of 0.01 s is exceeded", "not enough memory"), runtime


def test_the_limits_are_checked_before_each_function(
    runtime: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A few instructions can call slow functions, which run no instructions themselves."""
    monkeypatch.setattr(lua, "TIME_LIMIT", 0.0)
    for code in (
        "os.date()",
        "table.sort({2, 1}, rawequal)",
        "coroutine.wrap(os.time)()",
        "pcall(string.rep, 'x', 9)",
    ):
        assert failure(code) == "the time limit of 0 s is exceeded", (runtime, code)


def test_the_format_of_a_date_is_limited(runtime: str) -> None:
    assert "more than 200 characters" in failure("os.date(('%s'):rep(2e5))"), runtime
    assert run("os.date('!%Y-%m-%d', 0)") == "1970-01-01", runtime
    assert run("os.date('!*t', 0).year") == "1970", runtime
    assert run("#os.date() > 9") == "true", runtime


def test_printed_text_is_returned(runtime: str, capfd: pytest.CaptureFixture[str]) -> None:
    result = evaluate("for i = 1, 2 do print('a', i, nil) end return 1", lambda _: None)
    assert result.printed == "a\t1\tnil\na\t2\tnil\n"
    result = evaluate("for i = 1, 1e4 do print('x', param('n')) end return 1", {"n": 5}.get)
    assert result.printed == ("x\t5\n" * 500), runtime
    with pytest.raises(EvalError) as caught:
        evaluate("print('before') return error('why', 0)", lambda _: None)
    assert (str(caught.value), caught.value.printed) == ("why", "before\n")
    assert capfd.readouterr().out == ""


def test_reading_parameters_does_not_reset_the_time_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lua, "TIME_LIMIT", 0.04)
    code = """
        local stop = os.clock() + 0.01
        while os.clock() < stop do end
        for i = 1, 100 do param("p" .. i) end
        return 1
    """
    assert "the time limit of 0.04 s is exceeded" in failure(code)


HUGE = {
    "table": "local t = {} while true do t[#t + 1] = {} end return 1",
    "string": "local s = 'x' while true do s = s .. s end return 1",
    "rep": "return #string.rep('x', 1e9)",
    "rep of rep": "return #('x'):rep(1e6):rep(1e6)",
    "concat": """local t = {} for i = 1, 1000 do t[i] = ('x'):rep(1e5) end
        while true do t[1] = table.concat(t) end return 1""",
    "gsub": "return #('x'):rep(4000):gsub('x', ('y'):rep(1e5))",
    "in pcall": """while true do
        pcall(function() local s = 'x' while true do s = s .. s end end) end return 1""",
    "format": "local s = ('x'):rep(1e6) while true do s = ('%s%s%s'):format(s, s, s) end return 1",
    "concat of one text": """local s, t = ('x'):rep(1e6), {} for i = 1, 3000 do t[i] = s end
        return #table.concat(t)""",
    "format of one text": """local s, t = ('x'):rep(3e6), {} for i = 1, 200 do t[i] = s end
        return #(('%s'):rep(200)):format(unpack(t))""",
    "gsub with a table": "return #('x'):rep(1e4):gsub('x', {x = ('y'):rep(3e6)})",
    "closures": "local t = {} while true do t[#t + 1] = function() return t end end return 1",
    "coroutines": """local t = {} while true do
        t[#t + 1] = coroutine.create(function() end) end return 1""",
}


MEASURE = """
import json, resource, sys
from flatland.config import lua

runtime, huge = json.loads(sys.stdin.read())
lua._RUNTIMES = (runtime,)
lua.TIME_LIMIT = 0.1
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
before = peak()
for code in huge:
    try:
        answer = lua.evaluate(code, lambda name: None)
    except lua.EvalError as error:
        answer = error
    print(answer, flush=True)
print(peak() - before)
"""


@pytest.mark.slow
def test_memory_is_bounded(runtime: str) -> None:
    """Runs in a separate process: Lua can abort it if memory runs out outside a protected call."""
    folders = [str(Path(lua.__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
    done = run_program(
        [sys.executable, "-c", MEASURE],
        input=json.dumps([runtime, list(HUGE.values())]),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, folders))},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    *answers, grown = done.stdout.splitlines()
    assert len(answers) == len(HUGE)
    for name, answer in zip(HUGE, answers, strict=True):
        assert answer.endswith(("not enough memory", "the time limit of 0.1 s is exceeded")), (
            name,
            answer,
        )
    # An old lupa, or LuaJIT, has no memory limit; the usage is checked between instructions.
    bounded = "max_memory" in lua._state_factory()[0].keywords  # type: ignore[attr-defined]
    assert int(grown) < (80 if bounded else 600)  # MiB


def test_deep_recursion_raises_an_error(runtime: str) -> None:
    assert "stack overflow" in failure("local function f() return 1 + f() end return f()"), runtime
    assert failure("local t = setmetatable({}, {__index = function(t, k) "
                                 "return t[k .. 'x'] end}) return t.x")  # fmt: skip


def test_patterns_of_excessive_cost_are_rejected(runtime: str) -> None:
    cases = [
        ("('x'):rep(5e4)", "'x*y'"),
        ("('x'):rep(1e3)", "'x*x*x*y'"),
        ("('x'):rep(40)", "('x?'):rep(40) .. ('x'):rep(40)"),
        ("('('):rep(1e5)", "'%b()'"),
        ("('x'):rep(1e3)", "'(x*)(x*)%1%2y'"),
        ("('x'):rep(1e3)", "'[x]*[%]x]*[^]y]*[]x]*z'"),
        ("('x'):rep(1e3)", "'.-.-.-.-y'"),
        ("('x'):rep(4e3)", "'[^' .. ('a-b'):rep(300) .. ']*y'"),
    ]
    calls = ["find({0}, {1})", "match({0}, {1})", "gsub({0}, {1}, '')", "gmatch({0}, {1})()"]
    # The calls share the estimate of the cost: each pattern with one call, and one with all.
    for case, call in [*zip(cases, calls * 2, strict=False), *((cases[0], call) for call in calls)]:
        code = "return string." + call.format(*case)
        assert "may take too long for a text of" in failure(code), (runtime, code)
    assert "more than 1000 characters" in failure("('x'):find(('x?'):rep(1e5))"), runtime
    find = "('x'):rep(2e6):find(('x'):rep(1e6) .. 'y', 1, true)"
    assert "the text to find is too long" in failure(find), runtime


RESULTS = [
    ("('key = value'):match('^%s*(%S+)%s*=%s*(%S+)%s*$')", "key"),
    ("('a,b,c'):gsub(',', ';')", "a;b;c"),
    ("('a,b,c'):gsub(',', ';', 1)", "a;b,c"),
    ("('abc'):gsub('%w', {a = 1})", "1bc"),
    ("('a.b'):find('.', 1, true)", "2"),
    ("('aXb'):find('%u', 2)", "2"),
    ("('x'):rep(10000):gsub('x', '')", ""),
    ("('x'):rep(3):gsub('x', function(x) return x .. 'y' end)", "xyxyxy"),
    ("('ab'):gsub('(a)', setmetatable({}, {__index = function(t, key) return key .. key end}))",
     "aab"),
    ("('%s %d %5.1f %q'):format('a', 3, 2.25, 'q')", 'a 3   2.2 "q"'),
    ("table.concat({1, 'b', 3}, ', ', 2)", "b, 3"),
    ("('a b c'):gmatch('%a+')()", "a"),
    ("('f(a(b)c)'):match('%b()')", "(a(b)c)"),
    ("string.rep(12, 2)", "1212"),
    ("string.find(123, 2)", "2"),
    ("('x'):rep(0) .. ('x'):rep(-1) .. (''):rep(1e18)", ""),
    ("(function(t) table.sort(t) return table.concat(t) end)({3, 1, 2})", "123"),
    ("(function(t) table.sort(t, function(a, b) return a > b end) return t[1] end)({1, 3})", "3"),
    ("(function(t) table.insert(t, 4) table.insert(t, 1, 5) return t[1] end)({6})", "5"),
    ("select('#', unpack({1, nil, 3}, 1, 3))", "3"),
    ("select('#', unpack({}))", "0"),
    ("table.concat({unpack({'a', 'b', 'c'}, 2)})", "bc"),
    ("select('#', xpcall(function() return 1, 2 end, print))", "3"),
    ("select(2, xpcall(function() error('a', 0) end, function(e) return e .. 'b' end))", "ab"),
    ("select(2, pcall(error, 'a'))", "a"),
    ("coroutine.wrap(function(a) local b = coroutine.yield(a) return b end)(5)", "5"),
    ("select(2, pcall(coroutine.wrap(function() error('a', 0) end)))", "a"),
    ("coroutine.status(coroutine.create(function() end))", "suspended"),
    ("select('#', coroutine.resume(coroutine.create(function() return nil, nil end)))", "3"),
]  # fmt: skip


def test_guarded_functions_return_the_usual_results(runtime: str) -> None:
    found = [(code, run("return " + code)) for code, _ in RESULTS]
    assert found == RESULTS, runtime
    assert "number" in failure("(12345):rep(2)"), runtime


def test_indices_that_overflow_are_rejected(runtime: str) -> None:
    """Lua 5.1 crashes on some of them or runs for minutes."""
    for code, why in (
        ("unpack({}, -2^31, 2^31 - 2)", "too many results to unpack"),
        ("unpack({}, 2^31, -2^53)", "too many results to unpack"),
        ("unpack({}, 1, 1e5)", "too many results to unpack"),
        ("unpack({}, 0/0)", "too many results to unpack"),
        ("table.insert({}, -2^31 + 5, 1)", "position out of bounds"),
        ("table.insert({}, 2^31, 1)", "position out of bounds"),
        ("table.insert({}, 0/0, 1)", "position out of bounds"),
    ):
        assert why in failure(code), (runtime, code)


def test_large_inputs_are_rejected_before_evaluation() -> None:
    assert "exceed 1048576 bytes" in failure("-- " + "x" * 2_000_000)
    with pytest.raises(EvalError, match="exceed 1048576 bytes"):
        run("#param('a')", {"a": "x" * 2_000_000})
    assert run("#param('a')", {"a": "x" * 500_000}) == "500000"


def test_the_number_of_parameters_is_limited() -> None:
    with pytest.raises(EvalError, match="more than 200 parameters are read"):
        run("for i = 1, 1e3 do param('p' .. i) end return 1", {})


def test_unset_names_are_reported_once_and_limited_in_number() -> None:
    assert evaluate("env('NO_A') or env('NO_A') or env('NO_B')", lambda _: None).unset == (
        'env "NO_A"',
        'env "NO_B"',
    )
    many = evaluate("for i = 1, 1e4 do env('NO_' .. i) end return 1", lambda _: None)
    assert len(many.unset) == 20


def test_an_exception_of_the_lookup_propagates() -> None:
    def broken(_: str) -> object:
        raise ConnectionError("no master")

    with pytest.raises(ConnectionError, match="no master"):
        evaluate("pcall(param, 'a') and 1", broken)


def test_unusual_parameter_values() -> None:
    assert run("param('a')", {"a": "ü\0x"}) == "ü\0x"
    assert run("#param('a')", {"a": "\ud800"}) == "1"
    assert run("param('ü')", {"ü": 10**15}) == "1e+15"
    with pytest.raises(EvalError, match='param "a" is too large'):
        run("param('a')", {"a": 10**400})


def test_a_missing_lua_package_raises_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lua, "_RUNTIMES", ("no_such_module",))
    lua._state_factory.cache_clear()
    try:
        assert failure("1") == "the Python package lupa with Lua 5.1 or LuaJIT is required"
    finally:
        lua._state_factory.cache_clear()


def test_threads_can_evaluate_concurrently() -> None:
    codes = [f"param('a') * {number}" for number in range(100)]
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda code: run(code, {"a": 2}), codes))
    assert results == [str(2 * number) for number in range(100)]


def test_the_memory_of_states_is_released() -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    for _ in range(20):
        run("#('x'):rep(1e5)")
    gc.collect()
    before = resident()
    for _ in range(40):
        run("#('x'):rep(1e6)")
    gc.collect()
    assert resident() - before < 20e6


# -- random numbers ------------------------------------------------------------------------


def numbers(code: str, seeds: range) -> list[float]:
    return [float(evaluate(code, lambda _: None, seed).text) for seed in seeds]


def test_random_numbers_depend_on_the_seed_alone(runtime: str) -> None:
    first = numbers("math.random()", range(20))
    assert numbers("math.random()", range(20)) == first, runtime
    assert len(set(first)) == 20


def test_random_numbers_of_different_seeds_are_uniform() -> None:
    sample = sorted(numbers("math.random()", range(200)))
    assert all(0.0 <= number < 1.0 for number in sample)
    # The Kolmogorov-Smirnov distance of a uniform sample exceeds this with a probability of 1e-6.
    assert max(abs(number - i / 200) for i, number in enumerate(sample)) < 2.69 / 200**0.5


@pytest.mark.parametrize(
    ("arguments", "values"),
    [("6", range(1, 7)), ("-2, 1", range(-2, 2)), ("3, 3", [3]), ("2.9", [1, 2]), ("'2'", [1, 2])],
)
def test_random_integers_are_in_the_interval(arguments: str, values: range) -> None:
    assert set(numbers(f"math.random({arguments})", range(60))) == set(values)


def test_an_empty_interval_is_an_error(runtime: str) -> None:
    for arguments in ("0", "3, 1", "0/0", "'a'", "1, 0/0"):
        assert "interval is empty" in failure(f"math.random({arguments})"), (runtime, arguments)


@pytest.mark.parametrize("seed", ["7", "-1e300", "0/0", "'x'", ""])
def test_random_numbers_after_randomseed_do_not_depend_on_the_seed(seed: str) -> None:
    code = f"return (function() math.randomseed({seed}) return math.random() end)()"
    assert len(set(numbers(code, range(5)))) == 1
