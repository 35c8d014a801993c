"""Sources of YAML texts: relative paths and positions in messages."""

from __future__ import annotations

import pytest

from flatland.config.node import Source


@pytest.mark.parametrize(
    ("path", "resolved"),
    [
        ("a.yaml", "/folder/a.yaml"),
        ("../a", "/folder/../a"),
        ("/x/a", "/x/a"),
        ("~/a", "/home/me/a"),
    ],
)
def test_paths_are_relative_to_the_folder(
    path: str, resolved: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home/me")
    assert Source("w.yaml", "/folder").resolve(path) == resolved


def test_the_home_of_an_unknown_user_is_not_expanded() -> None:
    assert (
        Source("", "/folder").resolve("~nobody-of-that-name/a") == "/folder/~nobody-of-that-name/a"
    )


def test_positions_in_messages() -> None:
    assert Source("w.yaml", "/").place(3).suffix == " [w.yaml:3]"
    assert Source("w.yaml", "/").place(None).suffix == " [w.yaml]"
    assert Source("", "/").place(3).suffix == " [line 3]"
    assert Source("", "/").place(None).suffix == ""
