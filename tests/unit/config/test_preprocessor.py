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


def test_a_result_is_not_expanded_again(files: Files) -> None:
    assert files.plain("x: $eval '$' .. 'eval 1'") == {"x": "$eval 1"}


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


def test_an_endless_expression_is_stopped(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flatland.config.lua.TIME_LIMIT", 0.05)
    message = files.failure("a: 1\nx: $eval while true do end return 1\n")
    assert 'Failed to evaluate "while true do end return 1", ' in message
    assert message.endswith(f" [{files.path('main')}:2]")


def test_long_expressions_and_messages_are_shortened(files: Files) -> None:
    message = files.failure(f"x: $eval {'y' * 1000}.z")
    assert f'Failed to evaluate "{"y" * 500}...", ' in message
    assert len(message) < 1500
    assert len(files.failure("x: $eval error(('x'):rep(1e5))")) < 1000


# env and param


def test_env_converts_numbers(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"NUM": "1.50", "EXP": "1e3", "TEXT": "a b", "HEX": "0x10", "NO": "",
                        "NEG": "-.5", "DATE": "2020-01-01"}.items():  # fmt: skip
        monkeypatch.setenv(f"FLATLAND_TEST_{name}", value)
    text = "\n".join(
        f"{name}: $eval env('FLATLAND_TEST_{name}')"
        for name in ("NUM", "EXP", "TEXT", "HEX", "NO", "NEG", "DATE")
    )
    assert files.plain(text) == {
        "NUM": "1.5",
        "EXP": "1000",
        "TEXT": "a b",
        "HEX": "0x10",
        "NO": "",
        "NEG": "-0.5",
        "DATE": "2020-01-01",
    }
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


def test_a_text_can_use_parameters_and_includes(tmp_path: Path) -> None:
    (tmp_path / "z.yaml").write_text("$eval param('a') + 1")
    text = "x: $eval param('a')\ny: $include z.yaml"
    assert YamlReader.from_string(text, {"a": 1}, tmp_path).plain() == {"x": "1", "y": "2"}


def test_parameters_of_unsupported_types_are_rejected(files: Files) -> None:
    assert 'param "f" must be a number, a string or a bool, got list' in files.failure(
        "x: $eval param('f')", PARAMS
    )


@pytest.mark.parametrize("call", ["env()", "env(5)", "env({})", "param()", "param(nil, 5)"])
def test_names_must_be_strings(files: Files, call: str) -> None:
    assert "requires a name, got" in files.failure(f"x: $eval {call}")


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


def test_any_node_can_be_included_anywhere(files: Files) -> None:
    text = "- $include scalar.yaml\n- {a: $include list.yaml}\n- $include empty.yaml\n"
    plain = files.plain(text, scalar="hello", list="[1, $include scalar.yaml]", empty="# nothing\n")
    assert plain == ["hello", {"a": ["1", "hello"]}, None]
    assert files.plain("$include list.yaml") == ["1", "hello"]


def test_included_files_are_preprocessed(files: Files) -> None:
    reader = files.read("a: $include part.yaml\n", {"p": 4}, part="b: $eval param('p') * 2\n")
    assert reader.plain() == {"a": {"b": "8"}}


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


def test_file_names_can_contain_spaces(files: Files) -> None:
    files.write(**{"a b": "1"})
    assert files.plain("x: $include   a b.yaml  ") == {"x": "1"}


def test_only_the_first_document_is_included(
    files: Files, caplog: pytest.LogCaptureFixture
) -> None:
    assert files.plain("$include two.yaml", two="a: 1\n---\nb: 2\n") == {"a": "1"}
    place = f"[{files.path('two')}:3]"
    assert caplog.messages == [f"Only the first of 2 YAML documents is used {place}"]


def test_include_all_inserts_every_document(files: Files) -> None:
    text = "- first\n- $[include] docs.yaml\n- last\n"
    plain = files.plain(text, docs="a: 1\n---\n[b]\n---\n---\nc\n")
    assert plain == ["first", {"a": "1"}, ["b"], None, "c", "last"]


def test_include_all_of_a_file_without_documents_inserts_nothing(files: Files) -> None:
    assert files.plain("a: ['$[include] no.yaml']\nb: []", no="# nothing\n") == {"a": [], "b": []}


def test_included_documents_are_preprocessed_in_their_folder(files: Files) -> None:
    plain = files.plain(
        "- $[include] sub/docs.yaml",
        sub__docs="a: $include x.yaml\n---\n- $[include] more.yaml\n---\n$eval 1+1\n",
        sub__x="X",
        sub__more="m\n---\nn\n",
    )
    assert plain == [{"a": "X"}, ["m", "n"], "2"]


def test_line_numbers_of_later_documents(files: Files) -> None:
    reader = files.read("- $[include] docs.yaml", docs="a: 1\n---\nb: 2\n")
    assert [item.line for item in reader.items()] == [1, 3]


def test_include_all_outside_a_list_is_an_error(files: Files) -> None:
    for text in ("a: $[include] docs.yaml", "$[include] docs.yaml"):
        message = files.failure(text, docs="1")
        assert message == (
            f"Flatland YAML: $[include] must be an item of a list [{files.path('main')}:1]"
        )


@pytest.mark.parametrize("marker", ["$include", "$[include]"])
def test_an_included_file_that_does_not_exist_is_an_error(files: Files, marker: str) -> None:
    message = files.failure(f"a: 1\nb:\n  - {marker} sub/no.yaml\n")
    assert message == (
        f"Flatland YAML: File specified in {marker} does not exist, "
        f"path={files.folder}/sub/no.yaml, include=sub/no.yaml [{files.path('main')}:3]"
    )
    assert f"File specified in {marker} does not exist" in files.failure(f"- {marker}")


def test_an_included_file_that_is_malformed_is_an_error(files: Files) -> None:
    message = files.failure("a: 1\nb: $include part.yaml\n", part="x: 1\ny: [\n")
    assert message == (
        f'Flatland YAML: Malformatted file, path="{files.path("part")}", line 3 col 1, '
        f"did not find expected node content [{files.path('main')}:2]"
    )


def test_an_included_folder_is_an_error(files: Files) -> None:
    assert "it is not a regular file" in files.failure("$include .")


def test_a_lua_error_contains_the_position_in_the_included_file(files: Files) -> None:
    message = files.failure("a: $include part.yaml", part="\n\nx: $eval 1 +\n")
    assert message.endswith(f"[{files.path('part')}:3]")


@pytest.mark.parametrize("marker", ["$include", "$[include]"])
def test_a_file_that_includes_itself_is_an_error(files: Files, marker: str) -> None:
    message = files.failure(f"a:\n- {marker} main.yaml\n")
    main = files.path("main")
    assert message == f"Flatland YAML: File includes itself, {main} -> {main} [{main}:2]"


def test_files_that_include_each_other_are_an_error(files: Files) -> None:
    message = files.failure(
        "a: $include b.yaml",
        b="- 1\n- $[include] sub/../c.yaml\n",
        c="1\n---\nx: [$include main.yaml]\n",
        sub__x="",
    )
    chain = " -> ".join([str(files.path("main")), str(files.path("b")), f"{files.folder}/c.yaml"])
    assert message == (
        f"Flatland YAML: File includes itself, {chain} -> {files.folder}/main.yaml "
        f"[{files.folder}/c.yaml:3]"
    )


def test_a_cycle_through_a_symbolic_link_is_an_error(files: Files) -> None:
    files.write(main="$include link.yaml")
    files.path("link").symlink_to(files.path("main"))
    assert "File includes itself" in files.failure("$include link.yaml")


def test_a_file_can_be_included_twice(files: Files) -> None:
    assert files.plain("[$include a.yaml, $include a.yaml]", a="1") == ["1", "1"]


def test_the_depth_of_includes_is_limited(files: Files) -> None:
    files.write(**{f"f{i}": f"[$include f{i + 1}.yaml]" for i in range(300)})
    assert "Nested deeper than 100 levels" in files.failure("$include f0.yaml")


def test_the_number_of_includes_is_limited(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flatland.config.preprocessor._MAX_INCLUDES", 50)
    files.write(**{f"f{i}": f"[$include f{i + 1}.yaml, $include f{i + 1}.yaml]" for i in range(30)})
    files.write(f30="x")
    assert "More than 50 files are included" in files.failure("$include f0.yaml")


def test_an_included_alias_is_included_once(files: Files) -> None:
    reader = files.read("a: &x $include part.yaml\nb: *x\n", part="c: 1")
    assert reader.plain() == {"a": {"c": "1"}, "b": {"c": "1"}}
