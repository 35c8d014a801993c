"""The files of the page, as far as they can be checked without a browser."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

import flatland.web

PAGE = Path(flatland.web.__file__).parent / "page"
# Not those of other projects in vendor/, which are loaded when they are needed.
MODULES = sorted(path.relative_to(PAGE).as_posix() for path in PAGE.glob("js/**/*.js"))
SHEETS = sorted(path.relative_to(PAGE).as_posix() for path in PAGE.glob("css/**/*.css"))


class Elements(HTMLParser):
    """Collects the elements of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def values(self, name: str) -> list[str]:
        return [value for _, attributes in self.found if (value := attributes.get(name))]


@pytest.fixture(scope="module")
def index() -> Elements:
    return Elements((PAGE / "index.html").read_text())


def test_all_modules_are_loaded_in_parallel(index: Elements) -> None:
    loaded = [
        attributes["href"] if tag == "link" else attributes["src"]
        for tag, attributes in index.found
        if attributes.get("rel") == "modulepreload" or tag == "script"
    ]
    assert sorted(filter(None, loaded)) == MODULES


def test_all_style_sheets_are_loaded(index: Elements) -> None:
    linked = [a["href"] for tag, a in index.found if tag == "link" and a["rel"] == "stylesheet"]
    assert sorted(filter(None, linked)) == SHEETS


def test_nothing_is_loaded_from_other_hosts(index: Elements) -> None:
    for path in [PAGE / "index.html", *(PAGE / name for name in MODULES + SHEETS)]:
        addresses = re.findall(r"(?:https?:)?//[\w.-]+\.\w+[^\s\"']*", path.read_text())
        assert [a for a in addresses if not a.startswith("http://www.w3.org/")] == [], path.name


def test_files_of_other_projects_exist_and_have_their_licence() -> None:
    if not (PAGE / "vendor").is_dir():
        pytest.skip("uPlot is not installed (make setup installs it)")
    sources = "".join((PAGE / module).read_text() for module in MODULES)
    names = set(re.findall(r"vendor/[\w./-]+", sources))
    assert names == {"vendor/uplot/uPlot.esm.js", "vendor/uplot/uPlot.min.css"}
    for path in (PAGE / name for name in names):
        assert path.stat().st_size > 0
        assert "Copyright" in (path.parent / "LICENSE").read_text()


def test_ids_are_unique_and_those_of_the_modules_exist(index: Elements) -> None:
    ids = index.values("id")
    assert len(ids) == len(set(ids))
    wanted = {
        name
        for module in MODULES
        for name in re.findall(r"byId\(\"([\w-]+)\"", (PAGE / module).read_text())
    }
    assert len(wanted) > 30
    assert wanted <= set(ids)


def test_icons_exist(index: Elements) -> None:
    symbols = {f"#{name}" for name in index.values("id") if name.startswith("icon-")}
    uses = {attributes["href"] for tag, attributes in index.found if tag == "use"}
    assert uses <= symbols
    sources = "".join((PAGE / module).read_text() for module in MODULES)
    named = re.findall(r"\bicon\(\"([\w-]+)\"\)|\bicon: \"([\w-]+)\"", sources)
    assert {f"#icon-{first or second}" for first, second in named} <= symbols


def test_labels_belong_to_controls(index: Elements) -> None:
    controls = {a.get("id") for tag, a in index.found if tag in ("input", "select", "output")}
    assert set(index.values("for")) <= controls
