"""Fixtures: a browser for all files, a room and its page for a file, reset before each test."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from chromium import Chromium, missing_programs
from viewed_world import ViewedWorld, viewed_room
from viewer_page import ViewerPage


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    """A browser for all tests of a process; the tests are skipped if Chromium is missing."""
    if missing := missing_programs():
        pytest.skip(f"not installed: {', '.join(missing)} (make setup-dev installs them)")
    with Chromium(tmp_path_factory.mktemp("downloads")) as browser:
        yield browser


@pytest.fixture(scope="module", autouse=True)
def closed_page(browser: Chromium) -> Iterator[None]:
    """Closes the page after the tests of a file; it would use half a processor in other tests."""
    yield
    browser.open("about:blank")


@pytest.fixture(scope="module")
def shared_room(
    tmp_path_factory: pytest.TempPathFactory, closed_page: None
) -> Iterator[ViewedWorld]:
    """A room with a robot and a crate that runs in real time."""
    with viewed_room(tmp_path_factory.mktemp("room")) as room:
        yield room


@pytest.fixture
def room(shared_room: ViewedWorld) -> ViewedWorld:
    """The room in the state after loading."""
    shared_room.reset()
    return shared_room


@pytest.fixture
def page(room: ViewedWorld, browser: Chromium) -> Iterator[ViewerPage]:
    """The page with the room in its first state; the test fails if the page logs an error."""
    page = ViewerPage(browser)
    if browser.url.startswith(room.viewer.url):
        page.reset()
    else:
        browser.console()
        page.open(room.viewer.url)
    page.wait_for_poses({name: room.pose(name) for name in room.names()})
    yield page
    assert browser.console() == []


@pytest.fixture(scope="module")
def violations(browser: Chromium) -> Callable[[], list[Any]]:
    """Returns what axe finds in the page of the browser in its current state."""
    # The package that contains axe-core is not imported.
    found = importlib.util.find_spec("axe_playwright_python")
    if found is None or found.origin is None:
        pytest.skip("axe-core is not installed (make setup-dev installs it)")
    source = Path(found.origin).with_name("axe.min.js").read_text(encoding="utf-8")

    def find() -> list[Any]:
        # Not as a <script>, which the content security policy of the page forbids.
        browser.run(source)
        result = browser.run_async(
            """
            const done = arguments[0];
            axe.run(document, {resultTypes: ["violations"]})
              .then(done, (error) => done(String(error)));
            """
        )
        assert isinstance(result, dict), result
        assert len(result["passes"]) > 20
        return [
            (rule["id"], node["target"], node["failureSummary"])
            for rule in result["violations"]
            for node in rule["nodes"]
        ]

    return find
