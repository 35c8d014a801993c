"""The check of a built site: nothing from other hosts, no missing files."""

from __future__ import annotations

import importlib.util
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def check_site(checkout) -> ModuleType:
    """The module of the tool."""
    path = checkout / "tools" / "check_site.py"
    spec = importlib.util.spec_from_file_location("check_site", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_complete_site_is_accepted(check_site, tmp_path, capsys):
    (tmp_path / "style.css").write_text("body {background: url(image.png)}")
    (tmp_path / "other.html").write_text('<a href="https://example.org">elsewhere</a>')
    (tmp_path / "index.html").write_text(
        '<link rel="stylesheet" href="style.css?v=1"><link rel="next" href="other.html">'
        '<a href="other.html#part">other</a><a href="#here">here</a>'
    )
    assert check_site.main([str(tmp_path)]) == 0
    assert "2 pages" in capsys.readouterr().out


@pytest.mark.parametrize(
    "page",
    [
        '<script src="https://example.org/a.js"></script>',
        '<img src="//example.org/badge.svg">',
        '<link rel="stylesheet" href="https://example.org/font.css">',
        '<img src="missing.png">',
        '<a href="missing.html#part">missing</a>',
    ],
)
def test_a_problem_is_reported(check_site, tmp_path, capsys, page):
    (tmp_path / "index.html").write_text(page)
    assert check_site.main([str(tmp_path)]) == 1
    assert "index.html: " in capsys.readouterr().out


def test_a_style_sheet_that_loads_from_another_host_is_reported(check_site, tmp_path, capsys):
    (tmp_path / "site.css").write_text('@import "https://example.org/font.css";')
    assert check_site.main([str(tmp_path)]) == 1
    assert "site.css: loads https://example.org/font.css" in capsys.readouterr().out
