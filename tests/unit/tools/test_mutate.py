"""The changes that `make mutate` makes, and what counts as equivalent."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture
def mutate(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module of the tool."""
    monkeypatch.syspath_prepend(str(checkout / "tools"))
    return importlib.import_module("mutate")


def changed(mutate: ModuleType, name: str, text: str) -> set[str]:
    """Returns the texts after each of the changes of a text."""
    return {change.apply(text) for change in mutate.mutations(Path(name), text)}


@pytest.mark.parametrize(
    ("text", "others"),
    [
        ("a < b", {"a <= b", "a > b"}),
        ("a is not b", {"a is b"}),
        ("(a) not in (b)", {"(a) in (b)"}),
        ("a and b or c", {"a or b or c", "a and b and c"}),
        ("not (a)", {"(a)"}),
        ("-a * 2", {"a * 2", "-a / 2", "-a * 3"}),
        ("ä = 'ä' + b", {"ä = 'ä' - b"}),
        ("a += 0.5", {"a -= 0.5", "a += 1.0"}),
        ("f(a, b, c=True)", {"f(b, a, c=True)", "f(a, b, )", "f(a, b, c=False)"}),
        ("np.maximum(a, b, out=c)", {"np.maximum(a, b, )"}),
        ("if a: pass", {"if not a: pass"}),
        ("def f(a=1):\n  a.b = c", {"def f(a=2):\n  a.b = c", "def f(a=1):\n  pass"}),
        ('def f(a: X | Y) -> Z[0]:\n  """Text."""', set()),
        ("@f(a, b)\nclass A: pass", set()),
    ],
)
def test_python_is_changed_at_nodes(mutate: ModuleType, text: str, others: set[str]) -> None:
    assert changed(mutate, "a.py", text) == others


@pytest.mark.parametrize(
    ("text", "others"),
    [
        ("return a < b;", {"return a <= b;", "return a > b;"}),
        ("std::vector<int> x;  // a < b, 1", set()),
        ("void f(int a, const B& b);", set()),
        ("return f(a, g(b, -c));", {"return f(g(b, -c), a);", "return f(a, g(-c, b));",
                                    "return f(a, g(b, c));"}),
        ("return std::max(a, b);", {"return std::min(a, b);"}),
        ("  a.b[i] = c;", {"  ;"}),
        ("  a->clear();", {"  ;"}),
        ("if (!a) break;", {"if (!(!a)) break;", "if (a) break;", "if (!a) ;"}),
        ("x = 0.5F && 7U;", {"x = 1.0F && 7U;", "x = 0.5F && 8U;", "x = 0.5F || 7U;"}),
    ],
)  # fmt: skip
def test_cpp_is_changed_at_tokens(mutate: ModuleType, text: str, others: set[str]) -> None:
    assert changed(mutate, "a.cpp", text) == others


def test_an_equivalent_change_is_recognized_by_its_difference(mutate: ModuleType) -> None:
    text = "def f(a):\n    return a < 1\n"
    (change, *_) = mutate.mutations(Path("a.py"), text)
    described = mutate.describe("a.py", text, change)
    assert (described.line, described.function) == (2, "f")
    reason = "a is never 1,\nas the caller checks"
    listed = "\n".join(["# comment", "", "a.py f", *described.difference, reason])
    assert mutate.equivalents(listed) == {described.key: "a is never 1, as the caller checks"}


def test_each_equivalent_change_is_one_of_the_program(mutate: ModuleType, checkout: Path) -> None:
    known = mutate.equivalents((checkout / "tools" / "mutate_equivalent.txt").read_text())
    assert all(known.values()), "each change needs a reason"
    for name in {name for name, *_ in known}:
        text = (checkout / name).read_text()
        listed = {key for key in known if key[0] == name}
        lines = [f"- {line.strip()}" for line in text.splitlines()]
        # To describe a change takes long.
        changes = [
            change
            for change in mutate.mutations(Path(name), text)
            if any(lines[text.count("\n", 0, change.start)] in lost for _, _, lost in listed)
        ]
        assert listed <= {mutate.describe(name, text, each).key for each in changes}, name


def test_tests_mirror_a_file(mutate: ModuleType, checkout: Path) -> None:
    assert mutate.mirror("flatland/runtime/free_space.py", checkout) == [
        "tests/unit/runtime/test_free_space.py"
    ]
    assert mutate.mirror("flatland/plugins/_people_markers.py", checkout) == [
        "tests/unit/plugins/test_pedestrians.py",
        "tests/unit/plugins/test_pedestrians_states.py",
    ]
    laser = mutate.mirror("flatland/plugins/laser.py", checkout)
    assert "tests/unit/plugins/test_laser_batch.py" in laser
    with pytest.raises(ValueError, match="ROOM must be"):
        mutate.room_of("kitchen", checkout)
