"""Sources of YAML texts: relative paths and positions in messages."""

from __future__ import annotations

from pathlib import Path

import pytest

from flatland.config.node import Source


@pytest.mark.parametrize(
    ("path", "resolved"),
    [("a.yaml", "/folder/a.yaml"), ("../a", "/a"), ("/x/a", "/x/a"), ("~/a", "/home/me/a")],
)
def test_paths_are_relative_to_the_folder(
    path: str, resolved: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home/me")
    assert Source("w.yaml", "/folder").resolve(path) == resolved


def test_a_path_through_a_symbolic_link_stays(tmp_path: Path) -> None:
    """The folder above the target of a link is not the folder of the link."""
    (tmp_path / "elsewhere" / "deep").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere" / "deep")
    source = Source("w.yaml", str(tmp_path))
    assert source.resolve("link/../a.yaml") == f"{tmp_path}/link/../a.yaml"
    assert source.resolve("elsewhere/../a.yaml") == f"{tmp_path}/a.yaml"


def test_the_home_of_an_unknown_user_is_not_expanded() -> None:
    assert (
        Source("", "/folder").resolve("~nobody-of-that-name/a") == "/folder/~nobody-of-that-name/a"
    )


def test_positions_in_messages() -> None:
    assert Source("w.yaml", "/").place(3).suffix == " [w.yaml:3]"
    assert Source("w.yaml", "/").place(None).suffix == " [w.yaml]"
    assert Source("", "/").place(3).suffix == " [line 3]"
    assert Source("", "/").place(None).suffix == ""
