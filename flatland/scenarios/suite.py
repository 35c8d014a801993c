"""A suite: the scenario files of one or more paths, their runs, and how they are carried out."""

from __future__ import annotations

import fnmatch
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from flatland.config import hints
from flatland.config.reader import ReadYaml, read_yaml
from flatland.errors import FlatlandError
from flatland.scenarios.controllers import controller_digest, is_stack
from flatland.scenarios.episode import Options, Result
from flatland.scenarios.reader import is_scenario_file, read_scenarios
from flatland.scenarios.results import Journal, ResultsError, SuiteResults, key_of
from flatland.scenarios.scenario import Run, Scenario
from flatland.scenarios.workers import WorkerLimits, run_in_processes
from flatland.version import VERSION

SUITES: Final = Path(__file__).parent / "suites"
"""Folder of the included scenario files."""


class SuiteError(FlatlandError):
    """There is nothing to run."""

    prefix = "Flatland scenarios: "


def included_suites() -> list[str]:
    """Returns the names of the included scenario files."""
    return sorted(path.stem for path in SUITES.glob("*.yaml"))


def scenario_files(names: Iterable[str]) -> list[Path]:
    """Returns the scenario files of files, folders and names of included suites.

    In a folder, other YAML files are ignored.

    Raises:
        SuiteError: A path does not exist or contains no scenario.
    """
    files: dict[Path, None] = {}
    for name in names:
        path = Path(name)
        if path.is_dir():
            found = [file for file in sorted(path.rglob("*.yaml")) if is_scenario_file(file)]
            if not found:
                raise SuiteError(f"the folder {path} contains no scenario file")
            files.update(dict.fromkeys(found))
        elif path.is_file():
            files[path] = None
        elif name in included_suites():
            files[SUITES / f"{name}.yaml"] = None
        else:
            hint = hints.did_you_mean(name, included_suites(), "included suites")
            raise SuiteError(f"there is neither a file nor an included suite {name!r}", hint=hint)
    return list(files)


def load_suite(
    files: Iterable[Path],
    params: Mapping[str, object] | None = None,
    pattern: str | Sequence[str] = "",
    read: ReadYaml = read_yaml,
) -> list[Scenario]:
    """Reads scenario files.

    Args:
        files: The files.
        params: Values of `param()` in YAML files.
        pattern: Only scenarios with this title, or with a matching one, such as `*tour*`, or
            several patterns; empty for all scenarios.
        read: Loads a file, see `read_scenarios`.

    Raises:
        YamlError: A file is invalid.
    """
    scenarios = [one for file in files for one in read_scenarios(file, params, read)]
    if not pattern:
        return scenarios
    patterns = [pattern] if isinstance(pattern, str) else pattern
    wanted: dict[str, list[Scenario]] = {
        each: [
            one
            for one in scenarios
            # The values of a matrix are in brackets, which are a set of characters in a pattern.
            if one.title == each or fnmatch.fnmatchcase(one.title, each)
        ]
        for each in patterns
    }
    for each, found in wanted.items():
        if scenarios and not found:
            raise SuiteError(f"no scenario has a title that matches {each!r}")
    titles = {one.title for found in wanted.values() for one in found}
    return [one for one in scenarios if one.title in titles]


def runs_of(
    scenarios: Iterable[Scenario], controllers: Sequence[str], seeds: Sequence[int] | None = None
) -> list[Run]:
    """Returns the runs of scenarios with all controllers.

    Args:
        scenarios: The scenarios.
        controllers: Names of controllers.
        seeds: Seeds in place of those of the scenarios.
    """
    return [
        Run(scenario, controller, seed)
        for scenario in scenarios
        for seed in seeds or scenario.seeds
        for controller in dict.fromkeys(controllers)
    ]


def definition_of(runs: Sequence[Run], options: Options) -> str:
    """Returns a hash of everything that results depend on, except for the files of worlds.

    Raises:
        ControllerError: A controller does not exist.
    """
    digest = hashlib.sha256(VERSION.encode())
    for name in dict.fromkeys(run.controller for run in runs):
        known = f"{name} {controller_digest(name, options.folder)}\n"
        digest.update(known.encode(errors="surrogatepass"))
        if is_stack(name):
            digest.update(f"{options.stack!r}\n".encode())
    for run in runs:
        digest.update(f"{run!r}\n".encode())
    return digest.hexdigest()[:32]


@dataclass(frozen=True, slots=True)
class Plan:
    """How the runs of a suite are carried out.

    Attributes:
        options: Folders and recordings.
        limits: What a run may use.
        workers: Number of processes; None for one per core.
        continues: Whether to keep the results of an interrupted suite in the same folder.
    """

    options: Options
    limits: WorkerLimits
    workers: int | None = None
    continues: bool = False


Distribute = Callable[[Sequence[Run], Plan, Callable[[], object]], Iterator[Result]]
"""Yields the results of runs in any order; the function returns whether to stop."""


def run_locally(
    runs: Sequence[Run], plan: Plan, is_stopped: Callable[[], object]
) -> Iterator[Result]:
    """Carries out runs in processes of this machine."""
    workers = plan.workers or os.cpu_count() or 1
    yield from run_in_processes(runs, plan.options, plan.limits, workers, is_stopped)


def run_suite(
    runs: Sequence[Run],
    plan: Plan,
    *,
    distribute: Distribute = run_locally,
    is_stopped: Callable[[], object] = lambda: False,
    on_result: Callable[[Result], object] = lambda _result: None,
) -> SuiteResults:
    """Carries out the runs of a suite.

    Args:
        runs: The runs; their titles must be different.
        plan: How they are carried out.
        distribute: Where they are carried out.
        is_stopped: Returns whether to stop; results are partial then.
        on_result: Called with each result, also those that are kept.

    Returns:
        The results in the order of the runs.

    Raises:
        SuiteError: There are no runs, or two with the same title.
        ResultsError: The folder contains results of another suite.
    """
    order = {run.key: number for number, run in enumerate(runs)}
    if not order:
        raise SuiteError("there are no runs")
    if len(order) < len(runs):
        raise SuiteError("two scenario files have the same name; run them separately")
    folder = Path(plan.options.out)
    journal = Journal(folder, definition_of(runs, plan.options), continues=plan.continues)
    try:
        done = {key_of(row) for row in journal.results.rows}
        if not done <= order.keys():
            raise ResultsError(f"{folder} has results of runs that are not part of this suite")
        for result in journal.results.results:
            on_result(result)
        missing = [run for run in runs if run.key not in done]
        for result in distribute(missing, plan, is_stopped):
            journal.add(result)
            on_result(result)
    finally:
        journal.close()
    results = journal.results
    results.results.sort(key=lambda result: order[key_of(result.row)])
    results.missing = len(runs) - len(results.results)
    return results
