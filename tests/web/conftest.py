"""Fixtures: a browser for all tests of a process, worlds that it looks at, and its page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from chromium import Chromium, missing_programs
from viewed_world import ViewedWorld, viewed_room
from viewer_page import ViewerPage


@pytest.fixture(scope="session")
def start_browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], Chromium]]:
    """Starts browsers, which end with the last test; skips the test if Chromium is missing."""
    if missing := missing_programs():
        pytest.skip(f"not installed: {', '.join(missing)} (make setup-dev installs them)")
    with ExitStack() as browsers:
        yield lambda: browsers.enter_context(Chromium(tmp_path_factory.mktemp("downloads")))


@pytest.fixture(scope="session")
def browser(start_browser: Callable[[], Chromium]) -> Chromium:
    """A browser for most tests."""
    return start_browser()


@pytest.fixture(scope="session")
def other_browser(start_browser: Callable[[], Chromium]) -> Chromium:
    """A second browser, which shares nothing with the first one."""
    return start_browser()


@pytest.fixture(scope="module")
def shared_room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ViewedWorld]:
    """A room with a robot and a crate that runs in real time, for all tests of a file."""
    with viewed_room(tmp_path_factory.mktemp("room")) as room:
        yield room


@pytest.fixture
def room(shared_room: ViewedWorld) -> ViewedWorld:
    """The room in the state after loading."""
    shared_room.reset()
    return shared_room


@pytest.fixture
def page(room: ViewedWorld, browser: Chromium) -> Iterator[ViewerPage]:
    """The page with the room; the test fails if the page logs an error."""
    page = ViewerPage(browser)
    browser.console()
    page.open(room.viewer.url)
    yield page
    assert browser.console() == []
    browser.evaluate("localStorage.clear()")
    browser.open("about:blank")
