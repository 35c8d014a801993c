"""Loading of YAML files: nodes, positions, limits and errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from flatland.config.documents import load_documents, parse_documents
from flatland.config.inputs import Inputs
from flatland.config.node import MAX_NESTING, ListNode, MapNode, Node, NullNode, ScalarNode, Source
from flatland.errors import YamlError


def parse(text: str) -> list[Node]:
    return parse_documents(text, Source("w.yaml", "/folder"), Inputs())


def parse_map(text: str) -> MapNode:
    (root,) = parse(text)
    assert isinstance(root, MapNode)
    return root


def failure(text: str) -> str:
    with pytest.raises(YamlError) as caught:
        parse(text)
    return str(caught.value)


@pytest.mark.parametrize("text", ["123", "true", "1.50", "2001-01-01", "0x10", "-1", "a b", "a:b"])
def test_scalars_stay_text(text: str) -> None:
    node = parse_map(f"key: {text}").entries["key"]
    assert isinstance(node, ScalarNode)
    assert node.text == text


@pytest.mark.parametrize("text", ["", "~", "null", "Null", "NULL", "!!null", "# nothing"])
def test_empty_plain_values_are_null(text: str) -> None:
    assert isinstance(parse_map(f"key: {text}").entries["key"], NullNode)


@pytest.mark.parametrize("text", ['""', "''", "'~'", '"null"', "nULL", "!!str ~", "!!str"])
def test_quoted_or_tagged_values_are_not_null(text: str) -> None:
    assert isinstance(parse_map(f"key: {text}").entries["key"], ScalarNode)


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("1: a\n~: b\ntrue: c\n? null\n: d\n", ["1", "~", "true", "null"]),
        ("a: &x b\n*x : 1\n", ["a", "b"]),
        ("<<: {b: 1}\nd: 2\n", ["<<", "d"]),  # an ordinary key, as in the reference
    ],
)
def test_keys_stay_text(text: str, keys: list[str]) -> None:
    assert list(parse_map(text).entries) == keys


def test_nodes_have_line_numbers() -> None:
    root = parse_map(
        "# comment\na: 1\nb:\n  - x\n  -\t\n    c: |\n      two\n      lines\nd:\ne: {f:\n 2}\n"
    )
    items = root.entries["b"]
    assert isinstance(items, ListNode)
    inner = items.items[1]
    assert isinstance(inner, MapNode)
    assert root.entries["a"].line == 2
    assert (items.line, items.items[0].line, inner.line) == (4, 4, 6)
    assert inner.entries["c"].line == 6
    assert root.entries["d"].line == 9
    flow = root.entries["e"]
    assert isinstance(flow, MapNode)
    assert (flow.line, flow.entries["f"].line) == (10, 11)
    assert root.key_lines == {"a": 2, "b": 3, "d": 9, "e": 10}


def test_an_alias_is_the_node_of_its_anchor() -> None:
    root = parse_map("a: &x {b: 1}\nc: *x\nd: [*x, &y 5, *y]\n")
    assert root.entries["c"] is root.entries["a"]
    items = root.entries["d"]
    assert isinstance(items, ListNode)
    assert items.items[0] is root.entries["a"]
    assert items.items[1] is items.items[2]
    root = parse_map("a: &x 1\nb: &x 2\nc: *x\n")  # An anchor can be redefined.
    assert root.entries["c"] is root.entries["b"]


def test_documents_are_in_order_and_do_not_share_anchors() -> None:
    first, second, third = parse("a: &x 1\n---\n[2]\n---\n")
    assert isinstance(first, MapNode)
    assert isinstance(second, ListNode)
    assert isinstance(third, NullNode)
    assert 'line 3 col 1, undefined alias "x"' in failure("a: &x 1\n---\n*x\n")


@pytest.mark.parametrize("text", ["", "# only a comment\n", "\n\n", "\ufeff"])
def test_a_text_without_documents_has_no_roots(text: str) -> None:
    assert parse(text) == []


@pytest.mark.parametrize(
    ("text", "where", "why"),
    [
        ("a: [1, 2\nb: 3\n", "line 2 col 2", "did not find expected ',' or ']'"),
        ("a: b: c\n", "line 1 col 5", "mapping values are not allowed in this context"),
        ("a: 1\n b: 2\n", "line 2 col 3", "mapping values are not allowed in this context"),
        ("a: 'x\ny: 3", "line 2 col 5", "found unexpected end of stream"),
        ("a:\n\t- 1\n", "line 2 col 1", "found character that cannot start any token"),
        ("%YAML 3.0\n---\na", "line 1 col 1", "found incompatible YAML document"),
        ("a: *b\n", "line 1 col 4", 'undefined alias "b"'),
        ("? [a, b]\n: c\n", "line 1 col 3", "a key must be a scalar"),
        ("a: &x [1, *x]\n", "line 1 col 11", 'alias "x" refers to a node that contains it'),
        ("a: &x\n  b: {c: *x}\n", "line 2 col 10", 'alias "x" refers to a node that contains it'),
        ("a: 1\nb: '\x07'\n", "line 2 col 5", "character U+0007 is not allowed"),
        ("a: \ud800", "line 1 col 4", "character U+D800 is not allowed"),
        ("é: 1\nb: 'ü\x07' # \x08\n", "line 2 col 6", "character U+0007 is not allowed"),
        ("# \x07\n\x08: 1\n", "line 2 col 1", "character U+0008 is not allowed"),
        ("a: [\ufffd, b\x07]\n", "line 1 col 9", "character U+0007 is not allowed"),
        ("a: |\n  x\n\n  y\x07\n# \x08\n", "line 4 col 4", "character U+0007 is not allowed"),
        ("a: 1\n\t\nb: [\n", "line 4 col 1", "did not find expected node content"),
        ("-\tb\n", "line 1 col 2", "found character that cannot start any token"),
    ],
)
def test_malformed_text_is_an_error_with_its_position(text: str, where: str, why: str) -> None:
    assert failure(text) == f'Flatland YAML: Malformatted file, path="w.yaml", {where}, {why}'


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("a: 1\nb:\n  c: 1\n  d: 2\n  c: {e: 3, e: 4}\n", [("e", 5, 5), ("c", 3, 5)]),
        ("{a: 1,\n 'a': 2,\n \"a\": 3}", [("a", 1, 2), ("a", 1, 3)]),
        ("a: &x 1\nb: 2\n*x : 3\n1: 4\n", [("1", 3, 4)]),
        ("a: &x {<<: 1}\nb: {<<: 2, <<: *x}\n", [("<<", 2, 2)]),
    ],
)
def test_the_first_of_duplicate_keys_is_used(
    text: str, lines: list[tuple[str, int, int]], caplog: pytest.LogCaptureFixture
) -> None:
    parse(text)
    assert {record.levelname for record in caplog.records} == {"WARNING"}
    messages = [record.getMessage() for record in caplog.records]
    assert sorted(messages) == sorted(
        f'Duplicate key "{key}" ignored, the value in line {first} is used [w.yaml:{line}]'
        for key, first, line in lines
    )


def test_anchors_in_the_value_of_a_duplicate_key_are_defined() -> None:
    root = parse_map("a: 1\na: &x {b: 2}\nc: *x\n")
    first, alias = root.entries["a"], root.entries["c"]
    assert isinstance(first, ScalarNode)
    assert first.text == "1"
    assert isinstance(alias, MapNode)
    assert (root.key_lines["a"], list(alias.entries)) == (1, ["b"])


@pytest.mark.parametrize(
    "text",
    [
        "a: 1\n\t\nb: 2\n",
        "a: 1\n \t \n\t\t\nb: 2\n\t",
        "a: 1\n\t# comment\nb: 2\n",
        "a: 1\t# comment\nb: 2\t\n",
        "a: 1\r\n \t# comment\r\n\t\r\nb: 2\r\n",
        "\t\n\t# comment\n---\t# comment\na: 1\nb: 2\n",
        "{a: 1,\n\t\n\tb: 2}\t# comment\n",
    ],
)
def test_tabs_in_blank_lines_and_before_comments_are_allowed(text: str) -> None:
    entries = parse_map(text).entries.values()
    assert [node.text for node in entries if isinstance(node, ScalarNode)] == ["1", "2"]


@pytest.mark.parametrize(
    "text", ["a:\n-\t# comment\n  1\n- 2\n", "a: \t# one\n  \t#\n-\t\n  \t\n  1\n- 2\n"]
)
def test_tabs_after_the_dash_of_an_item_are_allowed(text: str) -> None:
    items = parse_map(text).entries["a"]
    assert isinstance(items, ListNode)
    assert [node.text for node in items.items if isinstance(node, ScalarNode)] == ["1", "2"]


def test_tabs_in_values_are_kept() -> None:
    root = parse_map('a: |\n  x\n  \t# y\n  \t\n  z\nb: "1\t# 2"\n')
    first, second = root.entries.values()
    assert isinstance(first, ScalarNode)
    assert isinstance(second, ScalarNode)
    assert (first.text, second.text) == ("x\n\t# y\n\t\nz\n", "1\t# 2")


@pytest.mark.parametrize(
    "line",
    ["\t" * 400_000 + "x", "-\t" * 200_000, " -" * 200_000 + "\t#"],
    ids=["tabs", "dashes and tabs", "dashes and a comment"],
)
def test_long_lines_of_white_space_are_read_in_linear_time(line: str) -> None:
    # A slower algorithm exceeds the time limit of the test suite.
    assert "Malformatted" in failure(f"a:\n{line}\n")


@pytest.mark.parametrize("opening", ["[", "- ", "? ", "{a: "])
def test_deep_nesting_is_rejected(opening: str) -> None:
    message = failure(opening * 50_000)
    assert f"nested deeper than {MAX_NESTING} levels" in message or "scalar" in message


def test_the_nesting_limit() -> None:
    assert parse("[" * MAX_NESTING + "]" * MAX_NESTING)
    assert "nested deeper" in failure("[" * (MAX_NESTING + 1) + "]" * (MAX_NESTING + 1))


def test_the_nesting_limit_includes_aliases() -> None:
    lines = ["a0: &a0 []"] + [f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, 200)]
    assert parse("\n".join(lines[: MAX_NESTING - 1]))
    assert "nested deeper" in failure("\n".join(lines))


def test_nested_aliases_are_shared_not_copied() -> None:
    lines = ["a0: &a0 [x, x]"] + [f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 60)]
    # Copies would not fit into memory.
    assert len(parse_map("\n".join(lines)).entries) == 60


def test_the_source_of_a_file_has_its_path_and_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A relative path is kept for messages."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "w.yaml").write_text("a: 1\n")
    for path in ("sub/w.yaml", str(tmp_path / "sub" / "w.yaml")):
        (root,) = load_documents(path, Inputs())
        assert root.source == Source(path, str(tmp_path / "sub"))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_supported_encodings(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "w.yaml"
    file.write_bytes("name: Rübe 🐢\n".encode(encoding))
    (root,) = load_documents(str(file), Inputs())
    assert isinstance(root, MapNode)
    node = root.entries["name"]
    assert isinstance(node, ScalarNode)
    assert node.text == "Rübe 🐢"


def test_windows_line_endings(tmp_path: Path) -> None:
    file = tmp_path / "w.yaml"
    file.write_bytes(b"a: 1\r\nb: x\r\nc: \xff\r\n")
    assert "line 3 col 4, byte 0xff is not valid UTF-8" in file_failure(file)
    file.write_bytes(b"a: 1\r\nb: x\r\n")
    (root,) = load_documents(str(file), Inputs())
    assert isinstance(root, MapNode)
    assert root.entries["b"].line == 2


def file_failure(path: Path | str) -> str:
    with pytest.raises(YamlError) as caught:
        load_documents(str(path), Inputs())
    return str(caught.value)


def test_undecodable_bytes_are_an_error(tmp_path: Path) -> None:
    file = tmp_path / "w.yaml"
    file.write_bytes("ä: 1\nb: ".encode() + b"\xe4\n")
    assert file_failure(file) == (
        f'Flatland YAML: Malformatted file, path="{file}", line 2 col 4, '
        "byte 0xe4 is not valid UTF-8"
    )
    file.write_bytes(b"\xff\xfea")
    assert "byte 0x61 is not valid UTF-16" in file_failure(file)


def test_undecodable_bytes_are_allowed_in_comments_only(tmp_path: Path) -> None:
    file = tmp_path / "w.yaml"
    file.write_bytes(
        b"# caf\xe9 \x80\na: Gr\xc3\xb6\xc3\x9fe # \xff\r\nb: |  # \xfc\n  one\n  two\n# \xe4\n"
    )
    (root,) = load_documents(str(file), Inputs())
    assert isinstance(root, MapNode)
    assert [node.text for node in root.entries.values() if isinstance(node, ScalarNode)] == [
        "Größe",
        "one\ntwo\n",
    ]
    for line, col, value in (
        (2, 5, b"a: b\xe4c # \xff\n"),
        (4, 3, b"a: '\n\n  \xe4'\n"),
        (2, 1, b"\xe4: 1\n"),
    ):
        file.write_bytes(b"# \xff\n" + value)
        assert file_failure(file).endswith(f"line {line} col {col}, byte 0xe4 is not valid UTF-8")


def test_a_file_that_does_not_exist_is_an_error(tmp_path: Path) -> None:
    for path in (tmp_path / "no.yaml", tmp_path / "no" / "no.yaml", f"{tmp_path}/a\0b"):
        assert file_failure(path) == f'Flatland YAML: File does not exist, path="{path}"'
    (tmp_path / "file").touch()
    assert "File does not exist" in file_failure(tmp_path / "file" / "w.yaml")
