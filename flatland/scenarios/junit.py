"""Results as a JUnit XML file, which servers for continuous integration show."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Final

from flatland.output_files import write_bytes
from flatland.scenarios.columns import FAULTS
from flatland.scenarios.results import SuiteResults
from flatland.scenarios.summary import group_of

_INVALID: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd]")  # in XML


def write_junit(results: SuiteResults, path: Path) -> None:
    """Writes one test suite for each scenario file, and one test case for each run.

    A run that does not meet its conditions is a failure, one with an error is an error.
    """
    root = ElementTree.Element("testsuites", name="flatland test")
    suites: dict[str, list[ElementTree.Element]] = {}
    for row in results.rows:
        case = ElementTree.Element(
            "testcase",
            classname=f"{group_of(row)}.{_clean(row['controller'])}",
            name=_clean(f"{row['scenario']} seed {row['seed']}"),
            time=f"{row['wall_time'] or 0:.3f}",
        )
        if not row["passed"]:
            kind = "error" if row["outcome"] in FAULTS else "failure"
            text = _clean(row["failures"] or "")
            ElementTree.SubElement(case, kind, message=text).text = text
        suites.setdefault(group_of(row), []).append(case)
    for name, cases in suites.items():
        counts = {"name": name, "tests": str(len(cases))}
        for kind in ("failure", "error"):
            counts[f"{kind}s"] = str(sum(case.find(kind) is not None for case in cases))
        suite = ElementTree.SubElement(root, "testsuite", counts)
        suite.extend(cases)
    ElementTree.indent(root)
    write_bytes(path, ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _clean(text: str) -> str:
    return _INVALID.sub("?", text)
