"""Files of results, comparisons, reports and pictures."""

from __future__ import annotations

import csv
import html.parser
import json
import math
import xml.etree.ElementTree as ElementTree

import pytest
from full_disk import REASON, limited_files

from flatland.scenarios.columns import COLUMNS, empty_row, error_row
from flatland.scenarios.comparison import compare
from flatland.scenarios.episode import Result
from flatland.scenarios.junit import write_junit
from flatland.scenarios.outline import Outline
from flatland.scenarios.pictures import run_picture
from flatland.scenarios.report import Report, worst_first, write_report
from flatland.scenarios.results import (
    ResultsError,
    SuiteResults,
    locked,
    read_results,
    write_results,
)
from flatland.scenarios.sketch import sketch
from flatland.scenarios.summary import (
    markdown_table,
    repetition_notes,
    summarize,
    summary_table,
)

SQUARE = [[(0.0, 0.0), (10.0, 0.0), (10.0, 5.0), (0.0, 5.0), (0.0, 0.0)]]


def row(scenario="s/a", controller="gap", seed=0, **values):
    good = {"passed": True, "success": True, "outcome": "reached", "spl": 1.0, "time": 10.0}
    good |= {"collisions": 0, "clearance": 0.5, "path_length": 5.0, "trajectory": str(seed)}
    return empty_row((scenario, controller, seed)) | good | values


FAILED = {"passed": False, "success": False, "outcome": "collision", "spl": 0.0, "collisions": 1}


@pytest.fixture
def results():
    results = SuiteResults("abc")
    outline = Outline("k", SQUARE)
    path = [(0.0, 1.0, 1.0), (1.0, 4.0, 2.0), (2.0, 9.0, 4.0)]
    results.add(Result(row(), path, [(9.0, 4.0)], outline=outline))
    failure = "<reached> & more\x00"
    bad = row(seed=1, failures=failure, **FAILED)
    event = (0.5, 2.0, 1.5, "kidnap")
    recording = "recordings/a.flog"
    results.add(Result(bad, path[:2], [(9.0, 4.0)], [event], Outline("k", SQUARE), recording))
    results.results[1].jumps = [(0.5, 1.5, 1.0, 2.0, 1.5)]
    results.results[1].models = [("box", "hit", [[(2.0, 2.0), (3.0, 2.0), (2.0, 2.0)]])]
    results.add(Result(error_row(("t", "gap", 0), "no <way>")))
    return results


def test_results_are_read_as_they_were_written(results, tmp_path):
    write_results(results, tmp_path)
    assert "NaN" not in (tmp_path / "results.json").read_text()
    found = read_results(tmp_path)
    assert found.rows == results.rows
    assert (found.definition, found.missing) == ("abc", 0)
    lines = [[list(point) for point in line] for line in SQUARE]
    assert found.outlines == {"k": lines}
    assert found.lines_of(found.results[1]) == lines
    assert found.lines_of(found.results[2]) == []
    assert found.results[1].recording == "recordings/a.flog"
    pictures = [run_picture(each.results[1], SQUARE) for each in (found, results)]
    assert pictures[0] == pictures[1]
    assert 'class="model hit"' in pictures[0]
    assert 'class="jump"' in pictures[0]
    assert [tuple(point) for point in found.results[0].path] == results.results[0].path
    with (tmp_path / "results.csv").open() as file:
        table = list(csv.DictReader(file))
    assert list(table[0]) == list(COLUMNS)
    assert [(line["scenario"], line["passed"], line["spl"]) for line in table] == [
        ("s/a", "True", "1.0"),
        ("s/a", "False", "0.0"),
        ("t", "False", ""),
    ]


GOOD = {"format": 1, "definition": "", "missing": 0, "outlines": {}, "runs": []}
KNOWN = {"scenario": "s", "controller": "c", "seed": 1, "passed": True, "outcome": "reached"}
KNOWN |= {"success": True}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "cannot be read"),
        ("[]", "must be results of `flatland test` in the format 1"),
        ("{}", "must be results of `flatland test` in the format 1"),
        ({"format": 99}, "in the format 1, got 99"),
        ({"format": [1]}, r"in the format 1, got \[1\]"),
        ({"format": 1}, "definition is missing"),
        ("[" * 100_000, "cannot be read: lists or maps are nested too deeply"),
        ('{"format": NaN}', "cannot be read: NaN is not a number"),
        (b"\xff\xfe", "cannot be read"),
        (GOOD | {"missing": True}, "missing must be an integer, got true"),
        (GOOD | {"outlines": []}, r"outlines must be a map, got \[\]"),
        (GOOD | {"outlines": {"k": [[1]]}}, r"outlines\.k must be a list of lines"),
        (GOOD | {"runs": {}}, "runs must be a list"),
        (GOOD | {"runs": ["x"]}, r'runs\[0\] must be a map, got "x"'),
        (GOOD | {"runs": [{}]}, r"runs\[0\]\.row is missing"),
        (GOOD | {"runs": [{"row": {}}]}, r"runs\[0\]\.row\.scenario is missing"),
        (GOOD | {"runs": [{"row": KNOWN}]}, r"runs\[0\]\.outline is missing"),
        (GOOD | {"runs": [{"row": KNOWN | {"seed": "1"}}]}, 'row.seed must be an integer, got "1"'),
        (GOOD | {"runs": [{"row": KNOWN | {"time": "1"}}]}, 'row.time must be a number, got "1"'),
        (GOOD | {"runs": [{"row": KNOWN, "path": [[1]]}]}, "path must be a list of lists of 3"),
    ],
)
def test_invalid_results_are_refused(content, message, tmp_path):
    text = content if isinstance(content, str | bytes) else json.dumps(content)
    (tmp_path / "r.json").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ResultsError, match=message) as caught:
        read_results(tmp_path / "r.json")
    assert "r.json" in str(caught.value)
    with pytest.raises(ResultsError, match="cannot be read"):
        read_results(tmp_path / "missing.json")


def test_results_of_other_versions_are_read(tmp_path):
    run = {"row": KNOWN | {"new": 1, "time": 3}, "outline": "", "new": []}
    (tmp_path / "results.json").write_text(json.dumps(GOOD | {"runs": [run], "new": {}}))
    (found,) = read_results(tmp_path).rows
    assert (found["seed"], found["time"], found["clearance"]) == (1, 3, None)
    assert "new" not in found


def test_a_spreadsheet_takes_no_text_for_a_formula(tmp_path):
    results = SuiteResults("")
    for seed, text in enumerate(("=1+1", "+1", "-1", "@x", "\t=1", "a=1")):
        results.add(Result(error_row(("-s", "=c", seed), text)))
    results.results[0].row["time"] = -1.5
    write_results(results, tmp_path)
    with (tmp_path / "results.csv").open() as file:
        table = list(csv.DictReader(file))
    errors = [line["error"] for line in table]
    assert errors == ["'=1+1", "'+1", "'-1", "'@x", "'\t=1", "a=1"]
    assert (table[0]["scenario"], table[0]["controller"], table[0]["time"]) == (
        "'-s",
        "'=c",
        "-1.5",
    )
    # Only in this format.
    assert read_results(tmp_path).rows[0]["error"] == "=1+1"


def test_foreign_texts_are_written_in_all_formats(tmp_path):
    results = SuiteResults("")
    results.add(Result(error_row(("s", "c", 0), "bad \udcff " + "A" * 5_000_000)))
    write_results(results, tmp_path)
    write_junit(results, tmp_path / "junit.xml")
    write_report(results, Report(["flatland", "test", "b\udcff.yaml"]), tmp_path / "report.html")
    for name in ("results.json", "results.csv", "junit.xml", "report.html"):
        assert "bad \\udcff AAA" in (tmp_path / name).read_text().replace("\\\\", "\\")
        assert (tmp_path / name).stat().st_size < 60_000
    with (tmp_path / "results.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 1


def test_a_file_that_cannot_be_written_is_named(results, tmp_path):
    with limited_files(100), pytest.raises(OSError, match=REASON) as caught:
        write_results(results, tmp_path)
    for name in ("results.json", "results.csv"):
        assert str(tmp_path / name) in str(caught.value)
    for write, name in (
        (lambda path: write_junit(results, path), "junit.xml"),
        (lambda path: write_report(results, Report(), path), "report.html"),
    ):
        with limited_files(100), pytest.raises(OSError, match=REASON) as caught:
            write(tmp_path / name)
        assert caught.value.filename == str(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_has_one_writer(tmp_path):
    folder = tmp_path / "out"
    with locked(folder), pytest.raises(ResultsError, match=r"writes to .*/out;"), locked(folder):
        pass
    with locked(folder):
        pass


def test_junit(results, tmp_path):
    write_junit(results, tmp_path / "junit.xml")
    root = ElementTree.parse(tmp_path / "junit.xml").getroot()
    suites = {suite.get("name"): suite for suite in root}
    for name, counts in (("s", ["2", "1", "0"]), ("t", ["1", "0", "1"])):
        assert list(map(suites[name].get, ("tests", "failures", "errors"))) == counts
    good, bad = suites["s"]
    assert (good.get("name"), list(good)) == ("s/a seed 0", [])
    assert bad[0].get("message") == "<reached> & more?"


# -- comparisons ---------------------------------------------------------------------------


def verdicts(comparison):
    return {one.measure: one.verdict for one in comparison.differences if one.verdict}


def test_equal_runs_do_not_differ():
    rows = [row(seed=seed, clearance=0.1 * seed) for seed in range(20)]
    comparison = compare(rows, rows)
    assert {one.pairs for one in comparison.differences} == {20}
    assert verdicts(comparison) == {}
    other = compare(rows, [row(scenario="other")])
    assert (other.differences, other.pairs, other.only_before, other.only_after) == ([], 0, 20, 1)


def test_what_became_worse_is_found():
    before = [row(seed=seed, time=10 + 0.1 * seed) for seed in range(20)]
    after = [row(seed=seed, time=9 + 0.1 * seed, clearance=0.4) for seed in range(20)]
    comparison = compare(before, after)
    assert verdicts(comparison) == {"time": "better", "clearance": "worse"}
    assert comparison.worse == ["clearance"]
    assert compare(after, before).worse == ["time"]
    found = {one.measure: one for one in comparison.differences}
    assert found["time"].before - found["time"].after == pytest.approx(1.0)


def test_differences_of_at_most_one_percent_do_not_matter():
    before = [row(seed=seed, time=100.0) for seed in range(20)]
    assert verdicts(compare(before, [row(seed=seed, time=100.9) for seed in range(20)])) == {}
    worse = compare(before, [row(seed=seed, time=101.5) for seed in range(20)])
    assert verdicts(worse) == {"time": "worse"}


def test_rates_are_compared_in_pairs():
    before = [row(seed=seed) for seed in range(12)]
    after = [row(seed=seed, **(FAILED if seed < 10 else {})) for seed in range(12)]
    comparison = compare(before, after)
    assert {"passed", "success", "spl", "collisions"} <= set(comparison.worse)
    # The times of runs without success are no times of the way.
    (time,) = [one for one in comparison.differences if one.measure == "time"]
    assert time.pairs == 2


def test_few_runs_are_not_significant():
    before = [row(seed=seed) for seed in range(4)]
    after = [row(seed=seed, **FAILED) for seed in range(4)]
    comparison = compare(before, after)
    assert comparison.worse == []
    # The runs themselves are listed.
    assert [str(one) for one in comparison.lost] == [
        f"s/a seed {seed}: collision" for seed in range(4)
    ]


def test_passed_is_tested_on_its_own():
    before = [row(seed=seed) for seed in range(17)]
    after = [row(seed=seed, passed=seed >= 8, failures="no contact") for seed in range(17)]
    comparison = compare(before, after)
    (passed,) = [one for one in comparison.differences if one.measure == "passed"]
    # 8 of 8 pairs that differ became worse, without a correction for other measures.
    assert passed.p_value == 2 / 2**8
    assert comparison.worse == ["passed"]
    assert (len(comparison.lost), comparison.gained) == (8, [])
    back = compare(after, before)
    assert (back.worse, len(back.gained), back.lost) == ([], 8, [])
    assert str(back.gained[0]) == "s/a seed 0: no contact"


def test_equal_runs_are_one_run():
    before = [row(seed=seed, trajectory="a") for seed in range(20)]
    after = [row(seed=seed, trajectory="b", time=5.0) for seed in range(20)]
    comparison = compare(before, after)
    assert (comparison.pairs, comparison.distinct) == (20, 1)
    assert verdicts(comparison) == {}
    assert {one.pairs for one in comparison.differences} == {1}
    # Equal trajectories among other people are other runs.
    for seed, one in enumerate(after):
        one["people_distance"] = 1.0 + seed
    assert verdicts(compare(before, after)) == {"time": "better"}
    # So are those in other scenarios.
    other = [one | {"scenario": f"s/{seed}"} for seed, one in enumerate(before)]
    assert compare(other, other).distinct == 20


def test_equal_runs_count_once_in_a_summary():
    rows = [row(seed=seed, trajectory="a") for seed in range(20)]
    rows += [row("s/b", seed=seed, **FAILED) for seed in range(3)]
    (summary,) = summarize(rows)
    assert (summary.runs, summary.passed.value) == (23, 1 / 4)
    assert summary.passed.high < 0.75
    notes = repetition_notes(rows)
    assert notes[1:] == ["  s/a with gap: 20 seeds, 1 distinct trajectory"]
    assert repetition_notes(rows[19:]) == []
    # The mean of a single run has no interval.
    (one,) = summarize(rows[:20])
    assert math.isnan(one.means["time"].low)
    assert "10.0 (" not in summary_table([one])


# -- tables --------------------------------------------------------------------------------


def test_summaries():
    rows = [row(seed=seed, spl=0.5 + 0.1 * seed) for seed in range(3)]
    rows += [row("t", seed=0, **FAILED), row("t", "own.py:A")]
    summaries = summarize(rows)
    assert [(one.group, one.controller, one.runs) for one in summaries] == [
        ("s", "gap", 3),
        ("t", "gap", 1),
        ("t", "own.py:A", 1),
        ("all", "gap", 4),
        ("all", "own.py:A", 1),
    ]
    assert summaries[0].means["spl"].value == pytest.approx(0.6)
    assert summaries[3].passed.value == 0.75
    assert math.isnan(summaries[1].means["time"].value)
    text = summary_table(summaries)
    assert text.splitlines()[1].split()[:5] == ["s", "gap", "3", "100", "%"]
    assert markdown_table(summaries).splitlines()[2].startswith("| s | `gap` | 3 | 100 % (44-100)")


def test_the_worst_runs_are_first(results):
    titles = [(one.row["outcome"], one.row["seed"]) for one in worst_first(results.results)]
    assert titles == [("error", 0), ("collision", 1), ("reached", 0)]


# -- report --------------------------------------------------------------------------------


class Page(html.parser.HTMLParser):
    """Checks that elements are nested, and collects them."""

    VOID = ("meta", "br", "link", "img")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts = ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts += data


def test_the_report_is_one_file(results, tmp_path):
    after = [row(seed=s, time=12) for s in range(8)] + [row(seed=8, **FAILED)]
    comparison = compare([row(seed=s) for s in range(9)], after)
    report = Report(["flatland", "test", "a b"], {"gap against the baseline": comparison})
    write_report(results, report, tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text().replace("<!DOCTYPE html>", ""))
    tags = [tag for tag, _ in page.elements]
    assert {"script", "img", "iframe"}.isdisjoint(tags)
    assert [attributes["href"] for tag, attributes in page.elements if tag == "link"] == ["data:,"]
    assert tags.count("article") == 3
    links = [attributes["href"] for tag, attributes in page.elements if tag == "a"]
    assert links == ["recordings/a.flog"]
    assert "1 of 3 runs passed, 1 with an error" in page.texts
    assert "<reached> & more" in page.texts
    assert f"flatland replay {tmp_path}/recordings/a.flog --view" in page.texts
    assert f"flatland replay {tmp_path} --view shows this report" in page.texts
    assert "kidnap at 0.50 s" in page.texts
    assert "worse" in page.texts
    assert "From pass to fail: 1s/a seed 8: collision" in page.texts
    first = page.texts.index("no <way>")
    assert first < page.texts.index("Replay")


def test_a_report_of_errors_only_can_be_written(tmp_path):
    results = SuiteResults("")
    results.add(Result(error_row(("t", "gap", 0), "no way")))
    results.missing = 3
    write_report(results, Report(), tmp_path / "report.html")
    assert "3 missing, because the suite was interrupted" in (tmp_path / "report.html").read_text()


def test_pictures_show_models_at_the_end_and_jumps():
    path = [(0.0, 1.0, 1.0), (1.0, 2.0, 1.0), (2.0, 6.0, 3.0), (3.0, 7.0, 3.0)]
    result = Result(row(), path, [(9.0, 3.0)])
    result.jumps = [(1.5, 2.5, 1.0, 5.5, 3.0)]
    box = [[(7.2, 2.8), (7.6, 2.8), (7.6, 3.2), (7.2, 2.8)]]
    far = [[(900.0, 0.0), (901.0, 0.0), (900.0, 0.0)]]
    result.models = [("box <1>", "hit", box), ("gone", "model", far)]
    assert result.tracks == [
        [(1.0, 1.0), (2.0, 1.0), (2.5, 1.0)],
        [(5.5, 3.0), (6.0, 3.0), (7.0, 3.0)],
    ]
    page = Page(run_picture(result, SQUARE))
    paths = {a["class"]: a["d"] for tag, a in page.elements if tag == "path"}
    assert paths["track"].count("M") == 2
    assert paths["jump"].count("L") == 1
    assert "box <1>, hit by the robot" in page.texts
    assert "model hit" in paths
    # The picture is as wide as the walls.
    (svg,) = [a for tag, a in page.elements if tag == "svg"]
    assert svg["width"] == "360"
    lines = sketch(result, SQUARE, columns=40, rows=12).splitlines()
    assert max(map(len, lines)) <= 40
    # The box is to the right of the end, and nothing is drawn along the jump.
    end = next(line for line in lines if "X" in line)
    assert end[end.index("X") + 1 :].strip("⡇⢸ ")
    assert sum("•" in line for line in lines) <= 2


def test_sketches_have_the_shape_of_the_world(results):
    text = sketch(results.results[0], SQUARE, columns=40, rows=12)
    lines = text.splitlines()
    assert len(lines) <= 12
    assert max(map(len, lines)) <= 40
    # From the lower left to the upper right.
    (start,) = [index for index, line in enumerate(lines) if "S" in line]
    (end,) = [index for index, line in enumerate(lines) if "X" in line]
    assert start > end
    assert lines[start].index("S") < lines[end].index("X")
    assert "•" in text
    assert sketch(results.results[2], []) == ""
