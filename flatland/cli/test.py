"""`flatland test`: scores controllers in scenarios, and reports what became better or worse."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from flatland.cli.arguments import Commands, add_command, add_param, count, positive
from flatland.cli.check import check_scenarios
from flatland.cli.contents import counted
from flatland.cli.progress import StopSignals, counting_bar
from flatland.foreign_texts import clean_name
from flatland.output_files import check_outputs
from flatland.scenarios.cluster import Cluster
from flatland.scenarios.columns import FAULTS
from flatland.scenarios.comparison import Change, Comparison, compare
from flatland.scenarios.controllers import INCLUDED, POLICY, split_names
from flatland.scenarios.episode import Options, Result
from flatland.scenarios.junit import write_junit
from flatland.scenarios.report import Report, worst_first, write_report
from flatland.scenarios.results import SuiteResults, locked, read_results, write_results
from flatland.scenarios.scenario import Run, Scenario
from flatland.scenarios.seeds import parse_seeds
from flatland.scenarios.sketch import sketch
from flatland.scenarios.stack_options import LOCALIZATIONS, PACES, StackOptions
from flatland.scenarios.suite import (
    SUITES,
    Plan,
    included_suites,
    load_suite,
    run_locally,
    run_suite,
    runs_of,
    scenario_files,
)
from flatland.scenarios.summary import (
    markdown_table,
    repetition_notes,
    summarize,
    summary_table,
)
from flatland.scenarios.workers import WorkerLimits

_EXAMPLES = (
    "flatland test --list",
    "flatland test office --robot gap",
    "flatland test my/scenarios --robot my.py:MyController,gap --out results",
    "flatland test my/scenarios --robot my.py:MyController --baseline old/results.json",
    "flatland test office maze --robot gap --seeds 0:20 --ray",
    "flatland test office --robot 'stack.launch planner:=dwa' --goal-action move_base",
    "flatland test office --robot 'stack.launch.py planner:=dwa'",
)
REGRESSIONS = ("any", "significant")
"""Which runs from pass to fail make a comparison with a baseline fail."""

_MEGABYTE = 1 << 20
_MOST_CHANGES = 100  # runs from pass to fail, or back, that are printed; the report has all
_MAX_LISTED = 5  # incomplete recordings
_REPORT = "report.html"


def add(commands: Commands) -> None:
    """Adds the command."""
    limits = WorkerLimits()
    parser = add_command(
        commands,
        "test",
        summary="score controllers in scenarios",
        description="Runs scenarios with controllers, on all cores, prints a table, and writes a "
        "report and the results of all runs. The exit code is 1 if a run does not meet its "
        "conditions; with --baseline, if a run that passed before does not pass, a measure became "
        "significantly worse, or a run has an error; and if a file of the results is incomplete.",
        examples=_EXAMPLES,
    )
    parser.add_argument(
        "paths",
        nargs="*",
        metavar="SCENARIOS",
        help="scenario files, folders, or names of included suites",
    )
    parser.add_argument("--list", action="store_true", help="list the scenarios and end")
    parser.add_argument(
        "--robot",
        action="append",
        metavar="CONTROLLER",
        help=f"{', '.join([*INCLUDED, POLICY])}, FILE.py:NAME, MODULE:NAME, FILE.onnx, "
        "'FILE.launch ARG:=VALUE ...', 'FILE.launch.py ARG:=VALUE ...' (also .xml, .yaml) or "
        "'command: PROGRAM ...'; may be given several times. Names without arguments can be "
        "separated by commas; with arguments, which are split as in a shell, commas are part of "
        "them (default: gap)",
    )
    parser.add_argument(
        "--seeds",
        type=_seeds,
        action="extend",
        metavar="LIST",
        help="in place of those of the files: 0:20 or 1,5:9; may be given several times",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="PATTERN",
        help="only scenarios with this title, or whose title matches: '*door*'; may be given "
        "several times",
    )
    add_param(parser)
    _add_results(parser.add_argument_group("results"))
    where = parser.add_argument_group("where to run")
    where.add_argument(
        "--workers", type=_at_least_one, metavar="N", help="processes (default: one per core)"
    )
    where.add_argument(
        "--ray",
        nargs="?",
        const="",
        metavar="ADDRESS",
        help="run on a Ray cluster: auto for one that was started on this machine, or HOST:PORT "
        "(default: start one)",
    )
    where.add_argument(
        "--working-dir",
        metavar="FOLDER",
        help="folder that Ray copies to all machines; it must contain all files",
    )
    _add_stack(parser.add_argument_group("controllers that are ROS nodes"))
    group = parser.add_argument_group("limits of a run")
    for name, default, text in (
        ("command-limit", limits.command_time, "wall time of a call of the controller [s]"),
        ("run-limit", limits.run_time, "wall time of a run [s]"),
        ("memory", limits.memory / _MEGABYTE, "memory of a run [MB]"),
    ):
        group.add_argument(
            f"--{name}",
            type=positive,
            default=default,
            metavar="X",
            help=f"{text} (default: {default:g})",
        )
    group.add_argument(
        "--show-output", action="store_true", help="show what controllers print, for debugging"
    )
    parser.set_defaults(run=_test)


def _add_results(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--out",
        type=Path,
        default=Path("flatland-test"),
        metavar="FOLDER",
        help="folder of the results (default: flatland-test)",
    )
    group.add_argument(
        "--continue",
        dest="continues",
        action="store_true",
        help="continue an interrupted suite in the same folder",
    )
    group.add_argument(
        "--baseline", type=Path, metavar="FILE", help="results.json of an earlier version"
    )
    group.add_argument(
        "--regressions",
        choices=REGRESSIONS,
        default=REGRESSIONS[0],
        help="runs from pass to fail that make a comparison with a baseline fail: any, or only so "
        f"many that passed is significantly worse (default: {REGRESSIONS[0]})",
    )
    group.add_argument(
        "--junit", type=Path, metavar="FILE", help="JUnit XML (default: junit.xml in the folder)"
    )
    group.add_argument(
        "--record",
        choices=("failed", "all", "none"),
        default="failed",
        help="runs of which recordings are kept (default: failed)",
    )
    group.add_argument(
        "--markdown", action="store_true", help="print the table in the form of Markdown"
    )


def _add_stack(group: argparse._ArgumentGroup) -> None:
    stack = StackOptions()
    group.add_argument(
        "--pace",
        choices=PACES,
        default=stack.pace,
        help="lockstep: the simulated time waits for the command of each period; real-time: a run "
        f"that does not hold it is invalid (default: {stack.pace})",
    )
    group.add_argument(
        "--localization",
        choices=LOCALIZATIONS,
        default=stack.localization,
        help="who sends the transform from map to the frame of the odometry: true for the "
        f"simulator, without an error (default: {stack.localization})",
    )
    group.add_argument(
        "--goal-topic",
        default=stack.goal_topic,
        metavar="TOPIC",
        help="topic of the goals, geometry_msgs/PoseStamped (default: move_base_simple/goal, in "
        "ROS 2 goal_pose)",
    )
    group.add_argument(
        "--goal-action",
        default="",
        metavar="NAME",
        help="action of the goals instead: move_base_msgs/MoveBaseAction, such as move_base, or in "
        "ROS 2 nav2_msgs/NavigateToPose, such as navigate_to_pose",
    )
    group.add_argument(
        "--stamped-commands",
        action="store_true",
        help="the nodes send geometry_msgs/TwistStamped, as Nav2 does since Kilted (ROS 2 only)",
    )
    group.add_argument(
        "--start-limit",
        type=positive,
        default=stack.start_time,
        metavar="X",
        help=f"wall time until the nodes are ready [s] (default: {stack.start_time:g})",
    )


def _test(options: argparse.Namespace) -> int:
    if options.list:
        return _list(options)
    if not options.paths:
        options.parser.error("name scenario files or included suites; --list shows the latter")
    if options.working_dir is not None and options.ray is None:
        options.parser.error("--working-dir requires --ray")
    controllers = _controllers(options.robot or ["gap"], options.working_dir or "")
    if not controllers:
        options.parser.error("--robot: must name a controller")
    check_outputs(options.junit)
    scenarios = _load(options)
    if scenarios is None:
        return 1
    baseline = None if options.baseline is None else read_results(options.baseline)
    runs = runs_of(scenarios, controllers, options.seeds and tuple(dict.fromkeys(options.seeds)))
    with locked(options.out):
        with StopSignals() as stop:
            results = _run(options, runs, stop)
        names = list(map(clean_name, controllers))
        comparisons = _comparisons(results, names, baseline)
        incomplete, has_report = _write(options, controllers, results, comparisons)
    _print(options, results, comparisons)
    if has_report:
        _print_report(options, results)
    for text in incomplete:
        print(f"flatland: {text}", file=sys.stderr)
    if stop.signal:
        print(f"interrupted: {counted(results.missing, 'run')} missing; --continue makes them")
        return 128 + stop.signal
    return 1 if incomplete else _exit_code(options, results, comparisons)


def _controllers(texts: Sequence[str], folder: str) -> list[str]:
    """Returns the controllers of the values of `--robot`, each once."""
    found = [name for text in texts for name in split_names(text, folder)]
    return list(dict.fromkeys(found))


def _list(options: argparse.Namespace) -> int:
    names = options.paths or included_suites()
    total = 0
    for scenario in load_suite(scenario_files(names), dict(options.param), options.only):
        total += len(scenario.seeds)
        shown = f"{scenario.title}  {counted(len(scenario.seeds), 'seed')}"
        print(f"{shown}  {scenario.description}".rstrip())
    print(f"{counted(total, 'run')} with one controller; the included suites are in {SUITES}")
    return 0


def _load(options: argparse.Namespace) -> list[Scenario] | None:
    """Returns the scenarios; None if they have errors. All problems are printed."""
    files, params = scenario_files(options.paths), dict(options.param)
    problems = [
        problem for file in files for problem in check_scenarios(file, params, options.seeds)[1]
    ]
    for problem in problems:
        print(problem.text(), file=sys.stderr)
    if any(problem.severity == "error" for problem in problems):
        return None
    return load_suite(files, params, options.only)


def _run(options: argparse.Namespace, runs: Sequence[Run], stop: StopSignals) -> SuiteResults:
    folder = options.working_dir or "."
    plan = Plan(
        Options(
            str(Path(folder).absolute()),
            str(options.out.absolute()),
            options.record,
            StackOptions(
                options.pace,
                options.localization,
                options.goal_topic,
                options.goal_action,
                options.start_limit,
                options.stamped_commands,
            ),
        ),
        WorkerLimits(
            options.command_limit,
            options.run_limit,
            round(options.memory * _MEGABYTE),
            options.show_output,
        ),
        options.workers,
        options.continues,
    )
    distribute = run_locally
    if options.ray is not None:
        distribute = Cluster(options.ray, options.working_dir or "").run
    with counting_bar(len(runs), "run") as advance:
        counts = {"failed": 0, "errors": 0}

        def on_result(result: Result) -> None:
            counts["errors"] += result.row["outcome"] in FAULTS
            counts["failed"] += not result.row["passed"]
            advance(f"failed: {counts['failed']}, errors: {counts['errors']}")

        return run_suite(
            runs,
            plan,
            distribute=distribute,
            is_stopped=lambda: stop.signal,
            on_result=on_result,
        )


# -- what is printed and written -----------------------------------------------------------


def _comparisons(
    results: SuiteResults, controllers: Sequence[str], baseline: SuiteResults | None
) -> dict[str, Comparison]:
    """Returns the comparisons with a baseline, or of the first with the other controllers."""
    rows = {
        name: [row for row in results.rows if row["controller"] == name] for name in controllers
    }
    if baseline is None:
        first, *others = rows
        return {f"{name} against {first}": compare(rows[first], rows[name]) for name in others}
    before = {
        name: [row for row in baseline.rows if row["controller"] == name]
        for name in dict.fromkeys(row["controller"] for row in baseline.rows)
    }
    if len(rows) == len(before) == 1:
        # One controller each, which may have another name now.
        ((name, new),) = rows.items()
        ((old_name, old),) = before.items()
        title = f"{name} against the baseline"
        if name != old_name:
            title += f" ({old_name})"
        return {title: compare(old, new)}
    return {
        f"{name} against the baseline": compare(before.get(name, ()), new)
        for name, new in rows.items()
    }


def _write(
    options: argparse.Namespace,
    controllers: Sequence[str],
    results: SuiteResults,
    comparisons: dict[str, Comparison],
) -> tuple[list[str], bool]:
    """Writes all files of results.

    Returns:
        Which files are incomplete, with the reasons, and whether the report was written.
    """
    folder = options.out
    command = ["flatland", "test", *options.paths]
    command += [word for name in controllers for word in ("--robot", name)]
    incomplete = [
        f"{folder / result.recording} is incomplete: {result.recording_error}"
        for result in results.results
        if result.recording_error
    ]
    if len(incomplete) > _MAX_LISTED:
        incomplete[_MAX_LISTED:] = [f"{len(incomplete) - _MAX_LISTED} more incomplete recordings"]
    for write in (
        lambda: write_results(results, folder),
        lambda: write_junit(results, options.junit or folder / "junit.xml"),
        lambda: write_report(results, Report(command, comparisons), folder / _REPORT),
    ):
        has_written = True
        try:
            write()
        except OSError as error:
            has_written = False
            incomplete.append(f"not written: {error}")
    return incomplete, has_written


def _print(
    options: argparse.Namespace, results: SuiteResults, comparisons: dict[str, Comparison]
) -> None:
    summaries = summarize(results.rows)
    print(markdown_table(summaries) if options.markdown else summary_table(summaries))
    notes = repetition_notes(results.rows)
    if notes:
        print("\n" + "\n".join(notes))
    for title, comparison in comparisons.items():
        print(f"\n{title}:")
        _print_comparison(comparison, has_baseline=options.baseline is not None)
    failed = [one for one in worst_first(results.results) if not one.row["passed"]]
    if failed and not options.markdown:
        worst = failed[0]
        row = worst.row
        print(f"\nworst run: {row['scenario']} {row['controller']} seed {row['seed']}")
        print(f"  {row['failures']}")
        picture = sketch(worst, results.lines_of(worst))
        if picture:
            print(picture)
        if worst.recording:
            print(f"flatland replay {options.out / worst.recording} --view")


def _print_report(options: argparse.Namespace, results: SuiteResults) -> None:
    print(f"\nreport: {options.out / _REPORT}")
    if any(result.recording for result in results.results):
        print(f"with links that replay the runs: flatland replay {options.out} --view")


def _print_comparison(comparison: Comparison, *, has_baseline: bool) -> None:
    if not comparison.pairs:
        print("  no runs in common")
        return
    if has_baseline:
        _print_changes("from pass to fail", comparison.lost)
        _print_changes("from fail to pass", comparison.gained)
        for number, where in (
            (comparison.only_before, "only in the baseline"),
            (comparison.only_after, "not in the baseline"),
        ):
            if number:
                print(f"  {counted(number, 'run')} {where}")
    shown = [one for one in comparison.differences if one.verdict]
    for one in shown:
        change = f"{one.before:.4g} -> {one.after:.4g}"
        print(f"  {one.measure} is {one.verdict}: {change} (p = {one.p_value:.2g})")
    if not shown:
        pairs = counted(comparison.distinct, "distinct pair")
        print(f"  no significant difference of a measure in {pairs} of runs")


def _print_changes(title: str, changes: Sequence[Change]) -> None:
    if not changes:
        return
    print(f"  {counted(len(changes), 'run')} {title}:")
    for change in changes[:_MOST_CHANGES]:
        print(f"    {change}")
    if len(changes) > _MOST_CHANGES:
        print(f"    and {len(changes) - _MOST_CHANGES} more, see the report")


def _exit_code(
    options: argparse.Namespace, results: SuiteResults, comparisons: dict[str, Comparison]
) -> int:
    if options.baseline is None:
        return 0 if all(row["passed"] for row in results.rows) else 1
    has_error = any(row["outcome"] in FAULTS for row in results.rows)
    is_worse = any(_is_worse(options, one) for one in comparisons.values())
    return 1 if has_error or is_worse else 0


def _is_worse(options: argparse.Namespace, comparison: Comparison) -> bool:
    # A baseline without runs in common says nothing.
    if not comparison.pairs or comparison.worse:
        return True
    return options.regressions == "any" and bool(comparison.lost)


# -- types of values -----------------------------------------------------------------------


def _seeds(text: str) -> tuple[int, ...]:
    try:
        return parse_seeds(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _at_least_one(text: str) -> int:
    number = count(text)
    if not number:
        raise argparse.ArgumentTypeError("must be at least 1")
    return number
