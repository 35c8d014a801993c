"""Typed reading: conversions, limits, error messages and the record of keys."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from flatland.config.reader import YamlReader
from flatland.errors import FlatlandError, YamlError


def read(text: str) -> YamlReader:
    return YamlReader.from_string(text)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "w.yaml"


def read_file(file: Path, text: str) -> YamlReader:
    file.write_text(text)
    return YamlReader.from_file(file)


def failure(action: Any, *arguments: Any, **options: Any) -> str:
    with pytest.raises(YamlError) as caught:
        action(*arguments, **options)
    assert isinstance(caught.value, FlatlandError)
    return str(caught.value)


FLOATS = {
    "1": 1.0,
    "-2.5": -2.5,
    "+3": 3.0,
    ".5": 0.5,
    "-.5": -0.5,
    "5.": 5.0,
    "5e-2": 0.05,
    "0.05e0": 0.05,
    "1e5": 1e5,
    "1E+5": 1e5,
    "007": 7.0,
    "1e-400": 0.0,
    '"5"': 5.0,
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF", "inf"), math.inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF", "-inf"), -math.inf),
}
INVALID_FLOATS = [
    "abc", "1.2.3", "1,5", "1e", "e5", ".", "'-'", "0x10", "1_000", '"5 "', '" 5"', "''", "1e400",
    "-1e400", ".iNF", ".infinity", "infinity", "Inf", "INF", "+inf", "NaN", "+.nan", "-nan", "true",
    "٣", "[1]", "{a: 1}",
]  # fmt: skip


@pytest.mark.parametrize(("text", "value"), FLOATS.items())
def test_valid_floats(text: str, value: float) -> None:
    assert read(f"x: {text}").get("x", "float") == value
    assert read(f"x: {text}").get("x", float) == value


@pytest.mark.parametrize("text", [".nan", ".NaN", ".NAN", "nan"])
def test_nan_is_a_float(text: str) -> None:
    assert math.isnan(read(f"x: {text}").get("x", "float"))


@pytest.mark.parametrize("text", INVALID_FLOATS)
def test_invalid_floats(text: str) -> None:
    message = failure(read(f"x: {text}").get, "x", "float")
    assert message == 'Flatland YAML: Error converting entry "x" to float [line 1]'


@pytest.mark.parametrize(
    ("text", "value"),
    {
        "0": 0, "-0": 0, "10": 10, "-10": -10, "+10": 10, "0x1f": 31, "-0x1F": -31,
        "0o17": 15, "017": 15, "-017": -15, "00": 0, '"7"': 7, "2147483647": 2**31 - 1,
        "-2147483648": -(2**31), "0x7fffffff": 2**31 - 1,
    }.items(),
)  # fmt: skip
def test_valid_ints(text: str, value: int) -> None:
    assert read(f"x: {text}").get("x", "int") == value
    assert type(read(f"x: {text}").get("x", int)) is int


@pytest.mark.parametrize(
    "text",
    [
        "10.0", "1e3", "abc", "08", "0o8", "0x", "0X1F", "0xg", "0b1", "1_000", "''", '"1 "', "--1",
        "true", ".inf", "2147483648", "-2147483649", "0x80000000", "0o40000000000", "9" * 5000,
        "[1]", "[]",
    ],
)  # fmt: skip
def test_invalid_ints(text: str) -> None:
    message = failure(read(f"x: {text}").get, "x", "int")
    assert message == 'Flatland YAML: Error converting entry "x" to int [line 1]'


@pytest.mark.parametrize("word", ["true", "yes", "on", "y", "false", "no", "off", "n"])
def test_bools_in_three_letter_cases(word: str) -> None:
    value = word in ("true", "yes", "on", "y")
    for text in (word, word.capitalize(), word.upper(), f'"{word}"'):
        assert read(f"x: {text}").get("x", "bool") is value
        assert read(f"x: {text}").get("x", bool) is value


@pytest.mark.parametrize(
    "text",
    ["1", "0", "t", "''", "truee", "[true]", "{}", "tRUE", "yES", "oN", "fALSE", "nO", "oFF"],
)
def test_invalid_bools(text: str) -> None:
    message = failure(read(f"x: {text}").get, "x", "bool")
    assert message == 'Flatland YAML: Error converting entry "x" to bool [line 1]'


@pytest.mark.parametrize(
    ("text", "value"),
    [("123", "123"), ("true", "true"), ("''", ""), ("1.50", "1.50"), ("'~'", "~"), ("a b", "a b")],
)
def test_any_scalar_is_a_string(text: str, value: str) -> None:
    assert read(f"x: {text}").get("x", "string") == value
    assert read(f"x: {text}").get("x", str) == value


@pytest.mark.parametrize("text", ["[a]", "{a: 1}", "", "~"])
def test_invalid_strings(text: str) -> None:
    message = failure(read(f"x: {text}").get, "x", "string")
    assert message == 'Flatland YAML: Error converting entry "x" to string [line 1]'


def test_valid_and_invalid_vectors() -> None:
    assert read("x: [1, -2.5]").get("x", "vector") == (1.0, -2.5)
    for text in ("[1]", "[1, 2, 3]", "[]", "[1, a]", "[1, [2]]", "[1, ]", "[1, ~]", "5", "{a: 1}"):
        message = failure(read(f"x: {text}").get, "x", "vector")
        assert message == 'Flatland YAML: Error converting entry "x" to vector [line 1]', text


@pytest.mark.parametrize(("kind", "size"), [("pose", 3), ("color", 4)])
def test_valid_and_invalid_poses_and_colors(kind: Any, size: int) -> None:
    numbers = [0.5 * number for number in range(5)]
    assert read(f"x: {numbers[:size]}").get("x", kind) == tuple(numbers[:size])
    for count in (0, size - 1, size + 1):
        message = failure(read(f"x: {[1.0] * count}").get, "x", kind)
        assert message == (f'Flatland YAML: Entry "x" must have size of exactly {size} [line 1]')
    message = failure(read("x: 5").get, "x", kind)
    assert message == 'Flatland YAML: Entry "x" must be a list [line 1]'
    message = failure(read(f"x: {['a'] * size}").get, "x", kind)
    assert message == ('Flatland YAML: Error converting entry index=0 to float (in "x") [line 1]')


def test_an_unknown_kind_is_a_value_error() -> None:
    with pytest.raises(ValueError, match=r"kind must be one of .*'pose'.*, got 'double'"):
        read("x: 1").get("x", "double")  # type: ignore[call-overload]


# Limits of numbers.


@pytest.mark.parametrize(
    ("kind", "text", "limits", "why"),
    [
        ("float", ".inf", {"finite": True}, "must be finite, got inf"),
        ("float", ".nan", {"finite": True}, "must be finite, got nan"),
        ("float", "-0.5", {"minimum": 0}, "must not be negative or NaN, got -0.5"),
        ("float", ".nan", {"minimum": 0}, "must not be negative or NaN, got nan"),
        (
            "float",
            "-1",
            {"finite": True, "minimum": 0},
            "must be finite and not negative, got -1.0",
        ),
        ("float", "-.inf", {"minimum": -2.5}, "must be at least -2.5, got -inf"),
        ("float", ".nan", {"maximum": 1}, "must be at most 1, got nan"),
        ("float", ".inf", {"finite": True, "maximum": 1}, "must be finite and at most 1, got inf"),
        ("float", "91", {"minimum": -90, "maximum": 90}, "must be from -90 to 90, got 91.0"),
        ("int", "0", {"minimum": 1}, "must be at least 1, got 0"),
        ("int", "17", {"minimum": 0, "maximum": 16}, "must be from 0 to 16, got 17"),
        ("vector", "[1, .nan]", {"finite": True}, "must be finite, got [1.0, nan]"),
        ("pose", "[1, 2, -.inf]", {"finite": True}, "must be finite, got [1.0, 2.0, -inf]"),
        ("color", "[0, 2, 0, 1]", {"maximum": 1}, "must be at most 1, got [0.0, 2.0, 0.0, 1.0]"),
        ("floats", "[0, .nan]", {"finite": True}, "must be finite, got [0.0, nan]"),
        (
            "vectors",
            "[[0, 0], [1, .inf]]",
            {"finite": True},
            "must be finite, got [(0.0, 0.0), (1.0, inf)]",
        ),
    ],
)
def test_numbers_that_violate_a_limit(
    file: Path, kind: Any, text: str, limits: dict[str, Any], why: str
) -> None:
    body = read_file(file, f"a: 1\nKey: {text}\n").with_location('model "M"', 'body "B"')
    expected = f'Flatland YAML: Invalid "Key", {why} (in model "m" body "b") [{file}:2]'
    get = body.get_list if kind.endswith("s") else body.get
    kind = kind.removesuffix("s")
    assert failure(get, "Key", kind, **limits) == expected
    assert failure(get, "Key", kind, 1.0, **limits) == expected


def test_limits_are_inclusive() -> None:
    reader = read("low: -1\nhigh: 2\npose: [-1, 0, 2]\ninf: .inf\nnan: .nan\nlist: [-1, 2]\n")
    for key in ("low", "high"):
        for kind in (int, float):
            reader.get(key, kind, finite=True, minimum=-1, maximum=2)
    assert reader.get("pose", "pose", finite=True, minimum=-1, maximum=2) == (-1, 0, 2)
    assert reader.get("inf", "float", minimum=0) == math.inf
    assert math.isnan(reader.get("nan", "float", finite=False))
    assert reader.get_list("list", "int", size=2, minimum=-1, maximum=2) == [-1, 2]


def test_limits_do_not_apply_to_defaults() -> None:
    assert read("{}").get("a", "float", -math.inf, finite=True, minimum=0) == -math.inf
    assert read("a:").get_list("a", "float", None, finite=True) is None


def test_invalid_has_the_position_of_the_entry_or_of_the_map(file: Path) -> None:
    reader = read_file(file, "# comment\na:\n  b: 1\n").with_location('layer "L"')
    text = "Flatland YAML: Invalid"
    assert str(reader.subnode("a").invalid("b", "must be even, got 1")) == (
        f'{text} "b", must be even, got 1 (in layer "l" "a") [{file}:3]'
    )
    assert str(reader.invalid("c", "must be even, got 1")) == (
        f'{text} "c", must be even, got 1 (in layer "l") [{file}:2]'
    )


# Error messages, which end with the position.


@pytest.mark.parametrize(
    ("text", "action", "message"),
    [
        ("a:\n  - 1\n", lambda r: r.subnode("a").get(1, "int"), 'index=1 does not exist (in "a")'),
        (
            "a:\n  - 1\n",
            lambda r: r.subnode("a").get(-1, "int"),
            'index=-1 does not exist (in "a")',
        ),
        (
            "a:\n  - []",
            lambda r: r.subnode("a").subnode(0, "map"),
            'index=0 must be a map (in "a")',
        ),
        (
            "a:\n  - {}",
            lambda r: r.subnode("a").subnode(0, "list"),
            'index=0 must be a list (in "a")',
        ),
        ("\n- 1", lambda r: r.get("a", "int"), "must be a map"),
        ("\n- 1", YamlReader.keys, "must be a map"),
        ("\n- 1", lambda r: r.without("a"), "must be a map"),
        ("\na: 1", lambda r: r.get(0, "int"), "must be a list"),
        ("\na: 1", lambda r: list(r.items()), "must be a list"),
    ],
)
def test_entries_of_another_kind(file: Path, text: str, action: Any, message: str) -> None:
    assert failure(action, read_file(file, text)) == f"Flatland YAML: Entry {message} [{file}:2]"


def test_lists_of_a_valid_size() -> None:
    reader = read("a: [1, 2, 3]\nb: [[1, 2], [3, 4]]\nc: []\nd: [x, 1]\ne: [[1, 2, 3]]\nf: [on]\n")
    for sizes in ({"size": 3}, {"min_size": 3}, {"max_size": 3}, {"min_size": 1, "max_size": 5}):
        assert reader.get_list("a", "float", **sizes) == [1.0, 2.0, 3.0]  # type: ignore[call-overload]
    assert reader.get_list("b", "vector") == [(1.0, 2.0), (3.0, 4.0)]
    assert reader.get_list("c", "int") == []
    assert reader.get_list("d", str) == ["x", "1"]
    assert reader.get_list("e", "pose") == [(1.0, 2.0, 3.0)]  # type: ignore[call-overload]
    assert reader.get_list("f", bool) == [True]
    assert reader.get_list("no", "int", [7]) == [7]
    assert reader.get_list("no", "int", None) is None


def test_only_maps_have_unknown_keys() -> None:
    for text in ("[1, 2]", "x", ""):
        assert read(text).ensure_accessed_all() is None
    assert "unrecognized" in failure(read("{a: 1}").ensure_accessed_all)


# Navigation.


def test_locations_build_up() -> None:
    text = "bodies: [{footprints: [{}, {type: circle, center: [x, 0]}]}]"
    body = read(text).subnode("bodies").subnode(0).with_location('model "turtlebot"', 'body "base"')
    footprints = body.subnode("footprints", "list")
    assert (footprints.location, footprints.name) == (
        'model "turtlebot" body "base"',
        '"footprints"',
    )
    second = footprints.subnode(1, "map")
    assert (second.location, second.name) == (
        'model "turtlebot" body "base" "footprints"',
        "index=1",
    )
    assert failure(second.get, "radius", "float") == (
        'Flatland YAML: Entry "radius" does not exist '
        '(in model "turtlebot" body "base" "footprints" index=1) [line 1]'
    )
    assert 'entry "center" to vector (in model "turtlebot" body "base" "footprints" index=1)' in (
        failure(second.get, "center", "vector")
    )


def test_the_kind_of_a_node() -> None:
    reader = read("a: {}\nb: []\nc: x\nd:\n")
    kinds = [
        (r.is_map, r.is_list, r.is_scalar, r.is_null) for r in map(reader.subnode, reader.keys())
    ]
    assert kinds == [tuple(i == j for j in range(4)) for i in range(4)]
    assert [len(reader.subnode(key)) for key in "abcd"] == [0, 0, 0, 0]
    assert len(reader) == 4
    assert reader.keys() == ["a", "b", "c", "d"]
    assert "a" in reader
    assert "d" in reader
    assert "e" not in reader
    assert "a" not in reader.subnode("c")


def test_items_of_a_list() -> None:
    items = list(read("a: [x, {b: 1}, [2]]").subnode("a").items())
    assert [item.name for item in items] == ["index=0", "index=1", "index=2"]
    assert [item.location for item in items] == ['"a"'] * 3
    assert items[0].value("string") == "x"
    assert items[1].get("b", "int") == 1
    assert items[2].get(0, "float") == 2.0
    assert items[2].get(1, "int", 7) == 7


def test_conversion_of_the_node_itself(file: Path) -> None:
    reader = read_file(file, "[5, true, [1, 2], [1, 2, 3], [0, 0, 0, 1]]")
    assert reader.subnode(0).value("int") == 5
    assert reader.subnode(0).value(float) == 5.0
    assert reader.subnode(1).value("bool") is True
    assert reader.subnode(2).value("vector") == (1.0, 2.0)
    assert reader.subnode(3).value("pose") == (1.0, 2.0, 3.0)
    assert reader.subnode(4).value("color") == (0.0, 0.0, 0.0, 1.0)
    assert failure(reader.value, "string") == (
        f"Flatland YAML: Error converting entry to string [{file}:1]"
    )


@pytest.mark.parametrize("text", ["{}", "x:", "x: ~", "x: null"])
def test_defaults_of_missing_or_empty_entries(text: str) -> None:
    reader = read(text)
    assert reader.get("x", "float", 2.5) == 2.5
    assert reader.get("x", "pose", None) is None
    assert reader.get_list("x", "string", ["all"]) == ["all"]
    for kind in ("any", "map", "list"):
        node = reader.optional_subnode("x", kind)  # type: ignore[arg-type]
        assert node.is_null
        assert (node.name, len(node), list(node.items()), node.keys()) == ('"x"', 0, [], [])
        node.ensure_accessed_all()
        assert node.get("y", "int", 3) == 3
        assert node.optional_subnode("y").is_null
        assert failure(node.get, "y", "int") == (
            'Flatland YAML: Entry "y" does not exist (in "x") [line 1]'
        )
    reader.ensure_accessed_all()


def test_an_empty_text_is_null() -> None:
    for text in ("", "# nothing\n", "---\n", "~\n"):
        assert read(text).is_null


def test_with_location_shares_the_record_of_keys_and_without_does_not() -> None:
    reader = read("a: 1\nb: 2\nname: n\n")
    placed = reader.with_location("x")
    placed.get("a", "int")
    reader.get("name", "string")
    assert '{"b"}' in failure(placed.ensure_accessed_all)
    rest = reader.without("name", "type")
    assert rest.keys() == ["a", "b"]
    assert "name" not in rest
    assert '{"a", "b"}' in failure(rest.ensure_accessed_all)
    rest.get("b", "int")
    assert failure(rest.ensure_accessed_all) == (
        'Flatland YAML: Entry contains unrecognized entry(s) {"a"} [line 1]'
    )
    assert '{"b"}' in failure(reader.ensure_accessed_all)
    assert reader.keys() == ["a", "b", "name"]
    # Each reader of an entry has its own record.
    reader = read("a: {b: 1}")
    reader.subnode("a").get("b", "int")
    assert '{"b"}' in failure(reader.subnode("a").ensure_accessed_all)


def test_without_keeps_the_location() -> None:
    rest = read("\na: 1\nc: 2\n").with_location('model "M"', 'plugin "P"').without("a")
    assert (rest.location, rest.name, rest.line) == ('model "M"', 'plugin "P"', 2)
    assert "[line 3]" in failure(rest.ensure_accessed_all)


def test_updated_replaces_and_adds_entries(file: Path) -> None:
    reader = read_file(file, "a: 1\nb: 2\n")
    other = read("\nb: 5\nc: 6\n")
    merged = reader.updated({key: other.subnode(key) for key in ("b", "c")})
    assert [merged.get(key, "int") for key in ("a", "b", "c")] == [1, 5, 6]
    assert merged.keys() == ["a", "b", "c"]
    merged.ensure_accessed_all()
    assert '{"a", "b"}' in failure(reader.ensure_accessed_all)
    # The place of an entry is that of the text that contains it.
    assert "[line 3]" in str(merged.invalid("c", "is wrong"))
    assert f"[{file}:1]" in str(merged.invalid("a", "is wrong"))
    assert read("~").updated({"b": other.subnode("b")}).get("b", "int") == 5
    assert "must be a map" in failure(lambda: read("[1]").updated({}))


def test_paths_are_relative_to_the_folder_of_the_file(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader = read_file(file, "a: 1\n")
    assert reader.resolve_path("map.yaml") == str(tmp_path / "map.yaml")
    assert reader.resolve_path("/maps/map.yaml") == "/maps/map.yaml"
    monkeypatch.setenv("HOME", "/home/me")
    assert reader.resolve_path("~/map.yaml") == "/home/me/map.yaml"
    monkeypatch.chdir(tmp_path)
    assert YamlReader.from_file("w.yaml").resolve_path("m") == str(tmp_path / "m")
    assert YamlReader.from_string("a: 1", base_dir="x").resolve_path("m") == str(tmp_path / "x/m")


def test_plain_returns_unconverted_data() -> None:
    reader = read("a: &x [1, ~, {b: on}]\nc: *x\nd: ''\n")
    shared = ["1", None, {"b": "on"}]
    assert reader.plain() == {"a": shared, "c": shared, "d": ""}
    assert reader.optional_subnode("no").plain() is None
