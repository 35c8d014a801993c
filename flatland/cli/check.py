"""`flatland check`: lists all problems of a world, model or scenario."""

from __future__ import annotations

import argparse
import dataclasses
import json
import logging
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from flatland.cli.arguments import Commands, add_command, file_arguments
from flatland.cli.contents import counted, print_contents
from flatland.cli.suspicious import warn_about_world
from flatland.config.collecting_reader import ErrorCollector
from flatland.errors import FlatlandError, Place
from flatland.loading.model_check import is_model_file, load_model_alone
from flatland.loading.world_loader import load_world
from flatland.loading.world_source import WorldSource
from flatland.scenarios.fit import check_fit
from flatland.scenarios.reader import Entry, is_scenario_file, read_entries
from flatland.scenarios.scenario import Scenario
from flatland.world import World

_EXAMPLES = (
    "flatland check worlds/office/world.yaml",
    "flatland check worlds/office/diff_robot.model.yaml",
    "flatland check worlds/office/world.yaml --json",
    "flatland check worlds/office/world.yaml --param /noise=0.1 --simplify-map 1",
)


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem of a file.

    Attributes:
        file: Absolute path of the file.
        line: Line number, from 1; None for the whole file.
        column: Column number, from 1; None if unknown.
        severity: `error`, or `warning` for a file that can be loaded.
        message: Description of the problem.
        hint: What probably helps, may be empty.
    """

    file: str
    line: int | None
    column: int | None
    severity: str
    message: str
    hint: str

    @classmethod
    def make(cls, severity: str, message: str, place: Place, hint: str = "") -> Problem:
        """Creates a problem from a message that may end with its place."""
        return cls(
            str(Path(place.path).absolute()),
            place.line,
            place.column,
            severity,
            message.removesuffix(place.suffix),
            hint,
        )

    def text(self) -> str:
        """Returns the problem as compilers print theirs: FILE:LINE: SEVERITY: MESSAGE."""
        where = [_shown(self.file), *(str(n) for n in (self.line, self.column) if n is not None)]
        text = f"{':'.join(where)}: {self.severity}: {self.message}"
        return f"{text}\n    hint: {self.hint}" if self.hint else text


def add(commands: Commands) -> None:
    """Adds the command."""
    parser = add_command(
        commands,
        "check",
        parents=[file_arguments("FILE", "world, model or scenario file")],
        summary="list all problems of a world, model or scenario",
        description="Loads a world, model or scenario with all of its files and prints every "
        "problem as FILE:LINE: error: TEXT, or the contents if there is none. A model is loaded "
        "into an empty world with the layers that the model names. The exit code is 1 if there are "
        "errors, and with --strict also if there are warnings.",
        examples=_EXAMPLES,
    )
    parser.add_argument("--json", action="store_true", help="print the problems as JSON")
    parser.add_argument("--strict", action="store_true", help="exit with 1 also for warnings")
    parser.set_defaults(run=_check)


def _check(options: argparse.Namespace) -> int:
    params = dict(options.param)
    if is_scenario_file(options.path):
        return _check_scenarios(options, params)
    root = Place(str(options.path))
    collector = ErrorCollector()
    world: World | None = None
    with _collected_warnings(collector, root) as problems:
        is_model = _is_model_file(options.path, params)
        try:
            if is_model:
                world = load_model_alone(World, options.path, params, collector.read)
            else:
                # A fixed seed: nothing random is printed, and no log line about a drawn seed.
                source = WorldSource(
                    options.path,
                    params=params,
                    simplify_map=options.simplify_map,
                    read=collector.read,
                )
                world = load_world(World, source, seed=0)
        except FlatlandError as error:
            collector.add(error)
        except Exception:
            if not collector.errors:
                raise
            # Otherwise the result of values in place of the invalid ones.
        if world is not None and not collector.errors:
            warn_about_world(world, params)
    problems[:0] = _errors_of(collector, root)
    _print(options, is_model, problems, world)
    return _exit_code(options, problems)


def _check_scenarios(options: argparse.Namespace, params: dict[str, object]) -> int:
    scenarios, problems = check_scenarios(options.path, params)
    _print_problems(options, "scenario", problems)
    if not options.json and all(problem.severity != "error" for problem in problems):
        runs = sum(len(scenario.seeds) for scenario in scenarios)
        print(f"{counted(len(scenarios), 'scenario')}, {counted(runs, 'run')} of each controller")
    return _exit_code(options, problems)


def check_scenarios(
    path: Path, params: Mapping[str, object], seeds: Sequence[int] | None = None
) -> tuple[list[Scenario], list[Problem]]:
    """Returns the scenarios of a file, and its problems and those of its worlds and models.

    Args:
        path: The file.
        params: Values of `param()` in YAML files.
        seeds: Seeds in place of those of the scenarios.
    """
    root = Place(str(path))
    collector = ErrorCollector()
    entries: list[Entry] = []
    with _collected_warnings(collector, root) as problems, collector.at(root):
        entries = read_entries(path, params, collector.read)
        if not collector.errors:
            check_fit(entries, collector, seeds)
    problems[:0] = _errors_of(collector, root)
    return [entry.scenario for entry in entries], problems


def _errors_of(collector: ErrorCollector, root: Place) -> list[Problem]:
    return [
        Problem.make("error", error.message, error.place or root, error.hint)
        for error in collector.errors
    ]


def _exit_code(options: argparse.Namespace, problems: list[Problem]) -> int:
    fatal = ("error", "warning") if options.strict else ("error",)
    return 1 if any(problem.severity in fatal for problem in problems) else 0


def _print_problems(options: argparse.Namespace, kind: str, problems: list[Problem]) -> None:
    """Prints the problems and their numbers."""
    errors = sum(problem.severity == "error" for problem in problems)
    warnings = len(problems) - errors
    if options.json:
        report = {
            "file": str(options.path.absolute()),
            "kind": kind,
            "errors": errors,
            "warnings": warnings,
            "problems": [dataclasses.asdict(problem) for problem in problems],
        }
        print(json.dumps(report, indent=2))
        return
    for problem in problems:
        print(problem.text())
    counts = [counted(errors, "error")] if errors else []
    counts += [counted(warnings, "warning")] if warnings else []
    print(f"{options.path}: {', '.join(counts) or 'no errors'}")


def _print(
    options: argparse.Namespace, is_model: bool, problems: list[Problem], world: World | None
) -> None:
    errors = sum(problem.severity == "error" for problem in problems)
    try:
        _print_problems(options, "model" if is_model else "world", problems)
        if world is not None and not errors and not options.json:
            print_contents(world)
            if is_model:
                layers = ", ".join(world.collision_filter.names) or "none"
                print(f"checked in an empty world with the layers that the model names: {layers}")
    finally:
        if world is not None:
            # An error of a plugin at its end is less important than the problems of the files.
            if errors:
                world.__exit__(FlatlandError, FlatlandError(), None)
            else:
                world.close()


def _is_model_file(path: Path, params: dict[str, object]) -> bool:
    try:
        return is_model_file(path, params)
    except FlatlandError:
        return path.name.endswith(".model.yaml")


def _shown(path: str) -> str:
    """Returns a path as it is printed: relative to the current folder, if that is shorter."""
    return min(os.path.relpath(path), path, key=len)


@contextmanager
def _collected_warnings(collector: ErrorCollector, root: Place) -> Iterator[list[Problem]]:
    """Collects the warnings that are logged in the block.

    Args:
        collector: Has the place of the entry that is being loaded.
        root: Place of warnings that concern no entry.
    """
    problems: list[Problem] = []

    class Handler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            place = getattr(record, "place", None)
            if place is None and collector.has_error_here:
                return  # It may result from a value in place of an invalid one.
            place = place or collector.place or root
            severity = "error" if record.levelno >= logging.ERROR else "warning"
            hint = getattr(record, "hint", "")
            problem = Problem.make(severity, record.getMessage(), place, hint)
            if problem not in problems:
                problems.append(problem)

    log, handler = logging.getLogger("flatland"), Handler(logging.WARNING)
    propagate, log.propagate = log.propagate, False
    log.addHandler(handler)
    try:
        yield problems
    finally:
        log.removeHandler(handler)
        log.propagate = propagate
