"""Expansion of `$eval` and `$include`: results, base folders and errors."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import pytest

from flatland.config.reader import YamlReader
from flatland.errors import YamlError


class Files:
    """YAML files in a folder, of which `main.yaml` is read."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def write(self, **texts: str) -> None:
        """Writes files; `a__b` is the file `b.yaml` in the folder `a`."""
        for name, text in texts.items():
            self.path(name).parent.mkdir(exist_ok=True)
            self.path(name).write_text(text)

    def path(self, name: str) -> Path:
        return self.folder / (name.replace("__", "/") + ".yaml")

    def read(self, main: str, params: Any = None, **texts: str) -> YamlReader:
        self.write(main=main, **texts)
        return YamlReader.from_file(self.path("main"), params)

    def plain(self, main: str, **texts: str) -> Any:
        return self.read(main, **texts).plain()

    def failure(self, main: str, params: Any = None, **texts: str) -> str:
        with pytest.raises(YamlError) as caught:
            self.read(main, params, **texts)
        return str(caught.value)


@pytest.fixture
def files(tmp_path: Path) -> Files:
    return Files(tmp_path)


# $eval


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("$eval 1/2", "0.5"),
        ("$eval 0/2.0", "0"),
        ("$eval 3.0", "3"),
        ("$eval 1/3", "0.33333333333333"),
        ("$eval 1e20", "1e+20"),
        ("$eval   2 + 3   ", "5"),
        ("$eval return 2 + 3", "5"),
        ("$eval(2 + 3)", "5"),
        ("$eval nil", ""),
        ("$eval", ""),
        ("$eval true", "true"),
        ("$eval 1 > 2", "false"),
        ("$eval 1, 2", "1"),
        ("$eval 1/0", "inf"),
        ("$eval 0/0", "nan"),
        ("$eval 'a' .. 1", "a1"),
        ("$eval '5'", "5"),
        ("$eval '$' .. 'eval 1'", "$eval 1"),  # a result is not expanded again
        ('"$eval \\"ü\\""', "ü"),
        ("$eval math.floor(math.pi)", "3"),
        ("$eval string.format('%03d', 7)", "007"),
        ("$eval ('x'):rep(3)", "xxx"),
        ("$eval table.concat({'a', 'b'}, '--')", "a--b"),
        ("$eval type(os.time()) .. type(os.clock()) .. type(os.date())", "numbernumberstring"),
        ("$eval _VERSION", "Lua 5.1"),
        ("|\n  $eval\n  local a = 2\n  return a * 3\n", "6"),
        ("|\n  $eval function twice(x)\n    return 2 * x\n  end\n  return twice(4)\n", "8"),
        (">\n  $eval 1\n  + 2\n", "3"),
    ],
)
def test_expressions_are_replaced_by_their_values(files: Files, text: str, result: str) -> None:
    assert files.plain(f"x: {text}") == {"x": result}


@pytest.mark.parametrize("text", ["a $eval 1", "' $eval 1'", "$ eval 1", "$Eval 1", "$$eval"])
def test_text_without_the_marker_at_the_start_is_unchanged(files: Files, text: str) -> None:
    assert files.plain(f"x: {text}") == {"x": text.strip("'")}


def test_expressions_are_evaluated_everywhere_except_in_keys(files: Files) -> None:
    text = "a: [$eval 1+1, {b: $eval 2+2}, [$eval 3+3]]\n$eval 4: c\nd: []\ne: {}\nf:\n"
    assert files.plain(text) == {
        "a": ["2", {"b": "4"}, ["6"]],
        "$eval 4": "c",
        "d": [],
        "e": {},
        "f": None,
    }
    assert files.plain("$eval 1+1") == "2"


def test_results_are_converted_like_other_scalars(files: Files) -> None:
    reader = files.read("a: $eval env('NO_SUCH', true)\nb: $eval 6/2\nc: $eval nil\nd: $eval 1/0")
    assert reader.get("a", "bool") is True
    assert reader.get("b", "int") == 3
    assert reader.get("c", "string", "default") == ""
    assert reader.get("d", "float") == float("inf")


def test_an_expression_with_aliases_is_evaluated_once(files: Files) -> None:
    counted: list[str] = []

    def param(name: str) -> int:
        counted.append(name)
        return len(counted)

    reader = files.read("a: &x $eval param('n')\nb: *x\nc: [*x]\n", param)
    assert reader.plain() == {"a": "1", "b": "1", "c": ["1"]}


def test_expressions_do_not_share_state(files: Files) -> None:
    text = "a: |\n  $eval x = 5 string.rep = nil\n  return x\nb: $eval x\nc: $eval ('-'):rep(2)\n"
    assert files.plain(text) == {"a": "5", "b": "", "c": "--"}


@pytest.mark.parametrize(
    ("text", "expression", "why"),
    [
        ("$eval 1 +", "1 +", "$eval:1: unexpected symbol near '<eof>'"),
        (
            "$eval nothing.x",
            "nothing.x",
            "$eval:1: attempt to index global 'nothing' (a nil value)",
        ),
        ("$eval error('my words')", "error('my words')", "my words"),
        ("$eval {}", "{}", "the result is a table, not a value"),
        ("$eval print", "print", "the result is a function, not a value"),
        ("$eval error({})", "error({})", "error of type table"),
        ("$eval '\\255'", "'\\255'", "b'\\xff' is not UTF-8 text"),
    ],
)
def test_an_error_contains_the_expression_and_the_lua_message(
    files: Files, text: str, expression: str, why: str
) -> None:
    message = files.failure(f"a: 1\nx: {text}\n")
    assert message.startswith(f'Flatland YAML: Failed to evaluate "{expression}", ')
    assert message.endswith(f"{why} [{files.path('main')}:2]")


def test_long_expressions_and_messages_are_shortened(files: Files) -> None:
    message = files.failure(f"x: $eval {'y' * 1000}.z")
    assert f'Failed to evaluate "{"y" * 500}...", ' in message
    assert len(message) < 1500
    assert len(files.failure("x: $eval error(('x'):rep(1e5))")) < 1000


# env and param


def test_env_converts_numbers(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    values = {
        "NUM": ("1.50", "1.5"),
        "EXP": ("1e3", "1000"),
        "TEXT": ("a b", "a b"),
        "HEX": ("0x10", "0x10"),
        "NO": ("", ""),
        "NEG": ("-.5", "-0.5"),
        "DATE": ("2020-01-01", "2020-01-01"),
    }
    for name, (value, _) in values.items():
        monkeypatch.setenv(f"FLATLAND_TEST_{name}", value)
    text = "\n".join(f"{name}: $eval env('FLATLAND_TEST_{name}')" for name in values)
    assert files.plain(text) == {name: result for name, (_, result) in values.items()}
    assert files.plain("x: $eval type(env('FLATLAND_TEST_NUM'))") == {"x": "number"}
    assert files.plain("x: $eval env('FLATLAND_TEST_NUM', 7) + 1") == {"x": "2.5"}


def test_an_unset_variable_is_nil_and_logged(
    files: Files, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, "flatland"):
        assert files.plain("a: 1\nx: $eval env('FLATLAND_TEST_NO')\n") == {"a": "1", "x": ""}
    (record,) = caplog.records
    assert (record.name, record.levelname) == ("flatland", "WARNING")
    assert record.getMessage() == f'env "FLATLAND_TEST_NO" is not set [{files.path("main")}:2]'


@pytest.mark.parametrize(
    ("default", "result"), [("2.5", "2.5"), ("'a'", "a"), ("true", "true"), ("false", "false")]
)
@pytest.mark.parametrize("kind", ["env", "param"])
def test_defaults_are_used_without_a_warning(
    files: Files, caplog: pytest.LogCaptureFixture, kind: str, default: str, result: str
) -> None:
    assert files.plain(f"x: $eval {kind}('FLATLAND_TEST_NO', {default})") == {"x": result}
    assert not caplog.records


PARAMS = {"/a": 5, "b": 2.5, "c": "text", "d": True, "e": False, "f": [1], "g": None, "/h/i": "1"}


@pytest.mark.parametrize(
    ("expression", "result"),
    [
        ("param('/a')", "5"),
        ("param('/a') / 2", "2.5"),
        ("param('b')", "2.5"),
        ("param('c') .. '!'", "text!"),
        ("param('d')", "true"),
        ("param('e')", "false"),
        ("param('e') and 1 or 2", "2"),
        ("param('/a', 7)", "5"),
        ("param('e', true)", "false"),
        ("param('/h/i')", "1"),
        ("param('a', 7)", "7"),
        ("param('g', 7)", "7"),
        ("param('/a') + param('b') + param('/a')", "12.5"),
        ("pcall(param, 'c')", "true"),
        ("select(2, pcall(param, 'c'))", "text"),
        ("coroutine.wrap(function() coroutine.yield(param('c')) end)()", "text"),
    ],
)
def test_param_returns_the_value(files: Files, expression: str, result: str) -> None:
    assert files.read(f"x: $eval {expression}", PARAMS).get("x", "string") == result
    assert files.read(f"x: $eval {expression}", PARAMS.get).get("x", "string") == result


def test_an_unset_parameter_is_nil_and_logged(
    files: Files, caplog: pytest.LogCaptureFixture
) -> None:
    text = "x: $eval param('no') == nil and param('no') == nil"
    for params in (None, {}, PARAMS):
        caplog.clear()
        assert files.read(text, params).get("x", "bool") is True
        assert [r.getMessage() for r in caplog.records] == [
            f'param "no" is not set [{files.path("main")}:1]'
        ]


def test_parameters_of_unsupported_types_are_rejected(files: Files) -> None:
    assert 'param "f" must be a number, a string or a bool, got list' in files.failure(
        "x: $eval param('f')", PARAMS
    )


@pytest.mark.parametrize("call", ["env()", "env(5)", "env({})", "param()", "param(nil, 5)"])
def test_names_must_be_strings(files: Files, call: str) -> None:
    assert "requires a name, got" in files.failure(f"x: $eval {call}")


def test_printed_text_becomes_a_line_of_the_log(
    files: Files, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.INFO, logger="flatland")
    files.read(r"""a: $eval print("\27[31mred", 2) return 1""")
    place = f"[{files.path('main')}:1]"
    assert caplog.messages == [rf"$eval printed: \x1b[31mred\t2 {place}"]
    caplog.clear()
    text = files.failure(r"""a: $eval print("why") return error("\27[31m")""")
    assert caplog.messages == [f"$eval printed: why {place}"]
    assert r"$eval:1: \x1b[31m" in text
    assert "\x1b" not in text
    files.read("a: $eval for i = 1, 1e4 do print('long') end return 1")
    assert len(caplog.messages[-1]) < 1000
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize(("code", "name"), [("0", "U+0000"), ("27", "U+001B"), ("127", "U+007F")])
def test_a_result_with_a_character_that_yaml_does_not_allow(
    files: Files, code: str, name: str
) -> None:
    text = files.failure(f"a: $eval return 'x' .. string.char({code})")
    assert f"the result contains the character {name} [" in text


# $include


def test_an_included_file_keeps_its_positions(files: Files) -> None:
    reader = files.read("a: $include part.yaml\nb: 1\n", part="\nc: 2\nd:\n  - 3\n")
    assert reader.plain() == {"a": {"c": "2", "d": ["3"]}, "b": "1"}
    inner = reader.subnode("a")
    assert (inner.path, inner.line) == (str(files.path("part")), 2)
    with pytest.raises(YamlError) as caught:
        inner.subnode("d").get(0, "bool")
    assert str(caught.value) == (
        'Flatland YAML: Error converting entry index=0 to bool (in "a" "d") '
        f"[{files.path('part')}:4]"
    )
    assert reader.subnode("b").path == str(files.path("main"))


@pytest.mark.parametrize(
    ("main", "texts", "plain"),
    [
        ("$include list.yaml", {"list": "[1, hello]"}, ["1", "hello"]),
        (
            "- $include scalar.yaml\n- {a: $include list.yaml}\n- $include empty.yaml\n",
            {"scalar": "hello", "list": "[1, $include scalar.yaml]", "empty": "# nothing\n"},
            ["hello", {"a": ["1", "hello"]}, None],
        ),
        ("x: $include   a b.yaml  ", {"a b": "$eval 1 + 1"}, {"x": "2"}),
        ("[$include a.yaml, $include a.yaml]", {"a": "1"}, ["1", "1"]),
        ("a: &x $include part.yaml\nb: *x\n", {"part": "c: 1"}, {"a": {"c": "1"}, "b": {"c": "1"}}),
        (
            "- first\n- $[include] docs.yaml\n- last\n",
            {"docs": "a: 1\n---\n[b]\n---\n---\nc\n"},
            ["first", {"a": "1"}, ["b"], None, "c", "last"],
        ),
        ("a: ['$[include] no.yaml']\nb: []", {"no": "# nothing\n"}, {"a": [], "b": []}),
        (
            "- $[include] sub/docs.yaml",
            {
                "sub__docs": "a: $include x.yaml\n---\n- $[include] more.yaml\n---\n$eval 1+1\n",
                "sub__x": "X",
                "sub__more": "m\n---\nn\n",
            },
            [{"a": "X"}, ["m", "n"], "2"],
        ),
    ],
)
def test_any_node_can_be_included_anywhere(
    files: Files, main: str, texts: dict[str, str], plain: object
) -> None:
    assert files.plain(main, **texts) == plain


def test_included_files_and_texts_use_the_parameters(files: Files) -> None:
    files.write(z="$eval param('a') + 1")
    text = "x: $eval param('a')\ny: $include z.yaml"
    for reader in (
        files.read(text, {"a": 1}),
        YamlReader.from_string(text, {"a": 1}, files.folder),
    ):
        assert reader.plain() == {"x": "1", "y": "2"}


def test_paths_are_relative_to_the_file_that_contains_them(
    files: Files, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    reader = files.read(
        "a: $include sub/b.yaml\nd: $include d.yaml\n",
        sub__b="c: $include c.yaml\nup: $include ../d.yaml\n",
        sub__c="map: here.png\n",
        c="wrong",
        d="top",
    )
    assert reader.plain() == {"a": {"c": {"map": "here.png"}, "up": "top"}, "d": "top"}
    inner = reader.subnode("a").subnode("c")
    assert inner.resolve_path(inner.get("map", "string")) == str(tmp_path / "sub" / "here.png")
    assert reader.resolve_path("x") == str(tmp_path / "x")


def test_line_numbers_of_later_documents(files: Files) -> None:
    reader = files.read("- $[include] docs.yaml", docs="a: 1\n---\nb: 2\n")
    assert [item.line for item in reader.items()] == [1, 3]


def test_only_the_first_document_is_included(
    files: Files, caplog: pytest.LogCaptureFixture
) -> None:
    assert files.plain("$include two.yaml", two="a: 1\n---\nb: 2\n") == {"a": "1"}
    place = f"[{files.path('two')}:3]"
    assert caplog.messages == [f"Only the first of 2 YAML documents is used {place}"]


@pytest.mark.parametrize(
    ("main", "part", "message"),
    [
        ("$include .", "", 'Failed to read file, path="{folder}", it is not a regular file'),
        ("a: $include part.yaml", "\n\nx: $eval 1 +\n", "[{folder}/part.yaml:3]"),
        (
            "a: $[include] part.yaml",
            "1",
            "$[include] must be an item of a list [{folder}/main.yaml:1]",
        ),
        (
            "$[include] part.yaml",
            "1",
            "$[include] must be an item of a list [{folder}/main.yaml:1]",
        ),
        (
            "a: 1\nb: $include part.yaml\n",
            "x: 1\ny: [\n",
            'Malformatted file, path="{folder}/part.yaml", line 3 col 1, '
            "did not find expected node content [{folder}/main.yaml:2]",
        ),
        *(
            row
            for marker in ("$include", "$[include]")
            for row in (
                (
                    f"a: 1\nb:\n  - {marker} sub/no.yaml\n",
                    "",
                    f"File specified in {marker} does not exist, path={{folder}}/sub/no.yaml, "
                    "include=sub/no.yaml [{folder}/main.yaml:3]",
                ),
                (f"- {marker}", "", f"File specified in {marker} does not exist"),
                (
                    f"a:\n- {marker} main.yaml\n",
                    "",
                    "File includes itself, {folder}/main.yaml -> {folder}/main.yaml "
                    "[{folder}/main.yaml:2]",
                ),
            )
        ),
    ],
)
def test_errors_of_includes(files: Files, main: str, part: str, message: str) -> None:
    assert message.format(folder=files.folder) in files.failure(main, part=part)


def test_files_that_include_each_other_are_an_error(files: Files) -> None:
    message = files.failure(
        "a: $include b.yaml",
        b="- 1\n- $[include] sub/../c.yaml\n",
        c="1\n---\nx: [$include main.yaml]\n",
        sub__x="",
    )
    chain = " -> ".join(f"{files.folder}/{name}.yaml" for name in ("main", "b", "c", "main"))
    assert message == f"Flatland YAML: File includes itself, {chain} [{files.folder}/c.yaml:3]"


def test_a_cycle_through_a_symbolic_link_is_an_error(files: Files) -> None:
    files.write(main="$include link.yaml")
    files.path("link").symlink_to(files.path("main"))
    assert "File includes itself" in files.failure("$include link.yaml")


def test_the_depth_of_includes_is_limited(files: Files) -> None:
    files.write(**{f"f{i}": f"[$include f{i + 1}.yaml]" for i in range(300)})
    assert "Nested deeper than 100 levels" in files.failure("$include f0.yaml")


def test_the_number_of_includes_is_limited(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flatland.config.preprocessor._MAX_INCLUDES", 50)
    files.write(**{f"f{i}": f"[$include f{i + 1}.yaml, $include f{i + 1}.yaml]" for i in range(30)})
    files.write(f30="x")
    assert "More than 50 files are included" in files.failure("$include f0.yaml")
