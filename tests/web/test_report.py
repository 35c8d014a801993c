"""The report of `flatland test` in a browser, in light and dark, and its links to replays."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from chromium import PHONE, Chromium
from flatland_command import main
from programs import Program
from viewed_world import ROBOT, write_room
from viewer_page import ViewerPage
from waiting import TIMEOUT

from flatland.scenarios.columns import empty_row, error_row
from flatland.scenarios.comparison import compare
from flatland.scenarios.episode import Result
from flatland.scenarios.outline import Outline
from flatland.scenarios.report import Report, write_report
from flatland.scenarios.results import SuiteResults

WALLS = [[(0.0, 0.0), (10.0, 0.0), (10.0, 5.0), (0.0, 5.0), (0.0, 0.0)]]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of a report with a success, a collision and an error."""
    folder: Path = tmp_path_factory.mktemp("report")
    results = SuiteResults("")
    values: dict[str, Any] = {"success": True, "passed": True, "outcome": "reached", "spl": 0.9}
    values |= {"time": 9.0, "clearance": 0.3, "collisions": 0, "path_length": 8.0, "jerk": 1.0}
    good = empty_row(("s/a", "gap", 0)) | values
    bad = good | {"seed": 1, "passed": False, "success": False, "outcome": "collision"}
    bad |= {"failures": "no contact: contact with walls", "spl": 0.0}
    path = [(0.0, 1.0, 1.0), (1.0, 4.0, 2.0), (2.0, 9.0, 4.0)]
    event = (1.0, 4.0, 2.0, "kidnap")
    results.add(Result(good, path, [(9.0, 4.0)], outline=Outline("k", WALLS)))
    results.add(Result(bad, path, [(9.0, 4.0)], [event], Outline("k", WALLS), "recordings/a.flog"))
    results.add(Result(error_row(("t", "gap", 0), "RuntimeError: " + "long" * 40)))
    before = [good | {"seed": seed} for seed in range(12)]
    slower = [row | {"time": 12.0} for row in before]
    differences = compare(before, slower)
    write_report(
        results,
        Report(["flatland", "test", "s.yaml"], {"gap against the baseline": differences}),
        folder / "report.html",
    )
    return (folder / "report.html").as_uri()


@pytest.fixture(params=["light", "dark"])
def report(request: pytest.FixtureRequest, browser: Chromium, address: str) -> Any:
    """The report in a colour scheme."""
    browser.resize(1200, 1600)
    browser.console()
    browser.prefer(prefers_color_scheme=request.param)
    with browser.requests() as urls:
        browser.open(address)
        yield browser
    assert browser.console() == []
    assert {url.partition("?")[0] for url in urls} <= {address, "about:blank"}
    browser.prefer()
    browser.resize(1200, 800)


def test_axe_finds_no_violation(report: Chromium, violations: Callable[[], list[Any]]) -> None:
    del report  # the page of the browser
    assert violations() == []


def test_the_colours_follow_the_scheme(report: Chromium, request: pytest.FixtureRequest) -> None:
    picture = report.picture()
    is_dark = float(np.median(picture)) < 60
    assert is_dark == ("dark" in request.node.name)


@pytest.mark.parametrize("report", ["light"], indirect=True)
def test_the_tracks_are_drawn(report: Chromium) -> None:
    boxes = "[...document.querySelectorAll('article svg .track')].map(e => e.getBBox().width)"
    assert all(width > 100 for width in report.evaluate(boxes))


@pytest.mark.parametrize("report", ["light"], indirect=True)
def test_the_page_is_not_wider_than_a_phone(report: Chromium) -> None:
    report.resize(*PHONE, touch=True)
    try:
        assert report.evaluate("document.documentElement.scrollWidth") == PHONE[0]
    finally:
        report.resize(1200, 1600)


# -- replays -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the results of two runs that fail, in the folder `out`."""
    folder: Path = tmp_path_factory.mktemp("suite")
    write_room(folder)
    (folder / "s.yaml").write_text("{world: world.yaml, goal: [4, 1], limits: {time: 1.5}}")
    options = ("--robot", "straight", "--seeds", "0:2", "--workers", "1")
    assert main("test", folder / "s.yaml", *options, "--out", folder / "out") == 1
    return folder


@pytest.fixture(scope="module")
def server(suite: Path) -> Iterator[Program]:
    """The command that serves the report."""
    command = [sys.executable, "-m", "flatland", "replay", suite / "out", "--view"]
    server = Program(command)
    yield server
    server.process.send_signal(signal.SIGINT)
    assert server.process.wait(TIMEOUT) == 130, server.output


def address_of(server: Program) -> str:
    """Returns the address that the command has printed."""
    return server.wait_for_line(r"report\.html is shown at (http://\S+)")[1]


def status_of(request: Request | str) -> tuple[int, str]:
    """Returns the status and the text of the response to a request that is not permitted."""
    with pytest.raises(HTTPError) as raised:
        urlopen(request, timeout=TIMEOUT)
    return raised.value.code, raised.value.read().decode()


def test_a_link_replays_its_run_in_the_viewer(
    suite: Path, server: Program, browser: Chromium
) -> None:
    report = address_of(server)
    runs = json.loads((suite / "out" / "results.json").read_text())["runs"]
    _time, x, y = runs[0]["path"][-1]
    browser.console()
    viewers = []
    # Each click starts another replay.
    for number in (1, 2):
        browser.open(report)
        browser.click(f"a[href='{runs[0]['recording']}']")
        page = ViewerPage(browser)
        page.wait_until_shown()
        # The end remains visible.
        browser.until("flatland.state.worlds[0].time > 1.49")
        page.wait_for_poses({"robot": (x, y, 0.0), "crate": (2, -2, 0)})
        viewers.append(browser.url)
        server.wait_for_line("(?s)" + "no difference.*" * number)
    assert viewers[0] != viewers[1]
    assert browser.console() == []


def test_what_is_not_served(suite: Path, server: Program) -> None:
    report = address_of(server)
    (suite / "robot.model.yaml").write_text(f"{ROBOT}# changed\n")
    (recording, _) = (suite / "out" / "recordings").iterdir()
    code, text = status_of(report.replace("report.html", f"recordings/{recording.name}"))
    assert code == 409
    assert "files have changed since the recording" in text
    assert "robot.model.yaml" in text
    # Pages of other sites receive nothing.
    assert status_of(Request(report, headers={"Host": "site.example"}))[0] == 403
    assert status_of(report.replace("report.html", "recordings/missing.flog"))[0] == 404
    assert status_of(report.replace("report.html", "../s.yaml"))[0] == 404
