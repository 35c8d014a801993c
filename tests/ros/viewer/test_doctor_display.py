"""`flatland doctor` on a virtual screen."""

from __future__ import annotations

from typing import Any

import pytest

from flatland.cli import doctor


def test_the_display_and_opengl_are_found(screen: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", screen.display)
    monkeypatch.delenv("QT_QPA_PLATFORM", raising=False)
    display, opengl = doctor._check_display()
    assert (display.name, display.status) == ("display", "ok")
    assert f"DISPLAY={screen.display}" in display.detail
    assert (opengl.name, opengl.status) == ("OpenGL", "ok")
    assert opengl.detail[0].isdigit()
