"""The report of `flatland test` in a browser, in light and dark."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chromium import PHONE, Chromium

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
    browser.requested_urls()
    browser.prefer(prefers_color_scheme=request.param)
    browser.open(address)
    yield browser
    assert browser.console() == []
    assert {url.partition("?")[0] for url in browser.requested_urls()} <= {address, "about:blank"}
    browser.prefer()
    browser.resize(1200, 800)


def test_axe_finds_no_violation(report: Chromium, axe: str) -> None:
    report.driver.execute_script(axe)
    found = report.driver.execute_async_script(
        "const done = arguments[0];"
        "axe.run(document).then((r) => done(r.violations.map((v) => [v.id, v.nodes[0].html])));"
    )
    assert found == []


def test_the_colours_follow_the_scheme(report: Chromium, request: pytest.FixtureRequest) -> None:
    picture = report.picture()
    is_dark = float(np.median(picture)) < 60
    assert is_dark == ("dark" in request.node.name)


def test_runs_are_drawn_with_walls_path_and_events(report: Chromium) -> None:
    boxes = "[...document.querySelectorAll('article svg .track')].map(e => e.getBBox().width)"
    assert all(width > 100 for width in report.evaluate(boxes))
    assert report.evaluate("document.querySelectorAll('article').length") == 3
    titles = "[...document.querySelectorAll('.event title')].map(e => e.textContent)"
    assert report.evaluate(titles) == ["kidnap at 1.00 s"]
    first = "document.querySelector('article').innerText"
    assert "RuntimeError" in report.evaluate(first)
    assert report.evaluate("document.querySelector('span.worse').textContent") == "worse"


def test_the_page_is_not_wider_than_a_phone(report: Chromium) -> None:
    report.resize(*PHONE, touch=True)
    try:
        assert report.evaluate("document.documentElement.scrollWidth") == PHONE[0]
    finally:
        report.resize(1200, 1600)
