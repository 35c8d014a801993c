"""How controllers are named."""

from __future__ import annotations

import pytest

from flatland.scenarios.controllers import (
    ControllerError,
    find_controller,
    is_stack,
    split_names,
)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("gap", ["gap"]),
        ("gap, straight,,my.py:Mine", ["gap", "straight", "my.py:Mine"]),
        ("a.onnx,stack.launch,nav.launch.py", ["a.onnx", "stack.launch", "nav.launch.py"]),
        (",", []),
        ("command: prog --list a,b", ["command: prog --list a,b"]),
        ("command:prog,a", ["command:prog,a"]),
        ("stack.launch topics:=[a,b] c:=d", ["stack.launch topics:=[a,b] c:=d"]),
        ("stack.launch.py '\"a, b\"'", ["stack.launch.py '\"a, b\"'"]),
        ("a,b/own.py:Mine", ["a,b/own.py:Mine"]),  # which exists
        ("a,b/stack.launch", ["a,b/stack.launch"]),
        ("a,b/none.py:Mine", ["a", "b/none.py:Mine"]),
        ("x," * 3000, ["x"] * 3000),
    ],
)
def test_commas_separate_only_names_without_arguments(text, names, tmp_path):
    (tmp_path / "a,b").mkdir()
    (tmp_path / "a,b" / "own.py").touch()
    (tmp_path / "a,b" / "stack.launch").touch()
    assert split_names(text, str(tmp_path)) == names


def test_a_list_that_was_not_split_has_a_hint():
    for name in ("gap,command: prog", "gap,stack.launch a:=1", "my dir/a.py:A,gap"):
        with pytest.raises(ControllerError) as caught:
            find_controller(name, "")
        assert "give --robot once for each controller" in caught.value.hint
    with pytest.raises(ControllerError) as caught:
        find_controller("gap2", "")
    assert not caught.value.hint


def test_the_path_of_a_launch_file_is_quoted_as_in_a_shell():
    for name in ("'my dir/stack.launch' a:=1", '"my dir/nav_launch.py"', "my\\ dir/a.launch"):
        assert is_stack(name)
    assert not is_stack("'my dir/own.py:A'")
    assert not is_stack("it's.py:A")


@pytest.mark.parametrize("error", ["KeyboardInterrupt('x')", "SystemExit('x')", "Evil"])
def test_an_import_that_raises_is_an_error(error, tmp_path):
    (tmp_path / "own.py").write_text(
        f"class Evil(BaseException):\n    def __str__(self): raise ValueError\nraise {error}\n"
    )
    with pytest.raises(ControllerError, match=r"'own.py:a': \w+: .+, while it was imported"):
        find_controller("own.py:a", str(tmp_path))
