"""The command line of a sweep."""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import importlib.util
import os
import signal
import sys
import time
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

from flatland.cli.arguments import count, parameter, positive
from flatland.version import VERSION
from flatland_sweep.cells import Cell, Row, Settings, SweepError, parse_seeds, table_of_cells
from flatland_sweep.controllers import INCLUDED, controller_file, find_controller

if TYPE_CHECKING:
    from flatland_sweep.results import Results

_FLUSH_PERIOD: Final = 2.0  # s; so much work is lost at most if this process is killed
_MAX_PENDING: Final = 1000  # rows
_EXIT_ERRORS: Final = 1
_EXIT_USAGE: Final = 2
_EXIT_INTERRUPTED: Final = 130
_EXTRA: Final = "pip install 'flatland-sim[ray]'"

_EXAMPLES: Final = """examples:
  sweep.py --worlds worlds/office/world.yaml --seeds 0:100 --controllers gap,pursuit --out results
  sweep.py --worlds a/*.yaml --seeds 0:10,50 --controllers my.py:MyController --out r --local
  sweep.py --worlds w.yaml --seeds 0:1000 --controllers gap --out r --address auto
  sweep.py --worlds w.yaml --seeds 0:9 --controllers gap --out r --address auto --working-dir w

The same command continues a sweep that was interrupted. More seeds, worlds or controllers can be
added later. The exit code is 0 if all cells were run, 1 if some of them have an error, 2 for
invalid arguments and 130 after Ctrl-C.
"""


def make_parser() -> argparse.ArgumentParser:
    """Returns the parser of the arguments."""
    parser = argparse.ArgumentParser(
        prog="sweep.py",
        description="Drives a robot from random starts to random goals: one episode for each\n"
        "combination of a world, a seed and a controller. Writes a table of the results.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    table = parser.add_argument_group("table")
    table.add_argument("--worlds", nargs="+", required=True, metavar="FILE", help="world files")
    table.add_argument(
        "--seeds", required=True, metavar="LIST", help="numbers and ranges, such as 0:100 or 1,5:9"
    )
    table.add_argument(
        "--controllers",
        required=True,
        metavar="LIST",
        help=f"names, separated by commas: {', '.join(INCLUDED)}, FILE.py:CLASS or MODULE:CLASS",
    )
    table.add_argument(
        "--out", type=Path, required=True, metavar="FOLDER", help="folder of the results"
    )
    table.add_argument("--retry-errors", action="store_true", help="run cells with an error again")
    where = parser.add_argument_group("where to run")
    where.add_argument(
        "--workers",
        type=_at_least_one,
        metavar="N",
        help="processes, or cells at the same time on a cluster (default: one per core)",
    )
    where.add_argument(
        "--local", action="store_true", help="use processes of this machine, without Ray"
    )
    where.add_argument(
        "--address",
        help="Ray cluster: auto for one that was started on this machine, or HOST:PORT "
        "(default: start one on this machine)",
    )
    where.add_argument(
        "--working-dir",
        metavar="FOLDER",
        help="folder that is copied to all machines of the cluster; paths of worlds and "
        "controllers start from it",
    )
    _add_settings(parser.add_argument_group("episodes"))
    return parser


def _add_settings(group: Any) -> None:
    known = Settings()
    group.add_argument(
        "--robot", default="", metavar="NAME", help="model (default: first one with a laser)"
    )
    group.add_argument("--laser", default="", metavar="NAME", help="its laser (default: first one)")
    group.add_argument(
        "--cmd-vel", default=known.cmd_vel, metavar="TOPIC", help="its command (default: cmd_vel)"
    )
    group.add_argument(
        "--param",
        type=parameter,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="value of param(NAME) in YAML files; may be given several times",
    )
    for name, kind, text in (
        ("period", positive, "time between two commands [s]"),
        ("time-limit", positive, "simulated time of an episode [s]"),
        ("tolerance", positive, "distance at which a goal is reached [m]"),
        ("min-distance", float, "minimum distance between start and goal [m]"),
        ("max-distance", positive, "maximum distance between start and goal [m]"),
        ("clearance", float, "distance of starts and goals to obstacles [m]"),
        ("max-speed", positive, "limit of the speed [m/s]"),
        ("max-turn", positive, "limit of the yaw rate [rad/s]"),
        ("max-collisions", count, "collisions after which the next one ends an episode"),
    ):
        default = getattr(known, name.replace("-", "_"))
        shown = "any" if default is None else f"{default:g}"
        group.add_argument(
            f"--{name}", type=kind, default=default, metavar="X", help=f"{text} (default: {shown})"
        )


def _at_least_one(text: str) -> int:
    number = count(text)
    if not number:
        raise argparse.ArgumentTypeError("must be at least 1")
    return number


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a sweep.

    Args:
        arguments: Arguments without the name of the program; None for those of the process.

    Returns:
        The exit code.

    Raises:
        SystemExit: The arguments are invalid (code 2), or request the help (code 0).
    """
    options = make_parser().parse_args(arguments)
    try:
        return _run(options)
    except SweepError as error:
        print(f"sweep.py: {error}", file=sys.stderr)
        return _EXIT_USAGE


def _run(options: argparse.Namespace) -> int:
    settings = _settings(options)
    cells = table_of_cells(
        [os.path.normpath(world) for world in options.worlds],
        [name.strip() for name in options.controllers.split(",") if name.strip()],
        parse_seeds(options.seeds),
    )
    _check_packages(options)
    folder = _folder(options)
    worlds = {cell.world: _world_path(cell.world, options, folder) for cell in cells}
    controllers = {cell.controller: _controller_hash(cell.controller, folder) for cell in cells}
    # After the check of the packages that it needs.
    from flatland_sweep.results import Results

    results = Results(options.out, {**settings.as_dict(), "flatland": VERSION})
    with contextlib.closing(results):
        results.define("worlds", worlds)
        results.define("controllers", controllers)
        missing = results.missing(cells, options.retry_errors)
        try:
            with _sigterm_as_interrupt():
                _run_cells(missing, len(cells), settings, options, results)
        except KeyboardInterrupt:
            left = len(results.missing(cells))
            print(
                f"sweep.py: interrupted with {left} of {len(cells)} cells missing; the same "
                "command continues the sweep",
                file=sys.stderr,
            )
            return _EXIT_INTERRUPTED
        return _report(results)


def _settings(options: argparse.Namespace) -> Settings:
    values: dict[str, Any] = {
        name: getattr(options, name) for name in Settings().as_dict() if name != "params"
    }
    return Settings(params=dict(options.param), **values)


def _check_packages(options: argparse.Namespace) -> None:
    needed = ["pandas", "pyarrow"]
    if options.local:
        for name in ("address", "working_dir"):
            if getattr(options, name) is not None:
                raise SweepError(f"--{name.replace('_', '-')} is for Ray, not for --local")
    else:
        needed.append("ray")
    missing = [name for name in needed if importlib.util.find_spec(name) is None]
    if missing == ["ray"]:
        raise SweepError(f"Ray is not installed: {_EXTRA}, or use --local")
    if missing:
        raise SweepError(f"{' and '.join(missing)} missing: {_EXTRA}")


def _folder(options: argparse.Namespace) -> str:
    """Returns the folder of this machine that relative paths start from."""
    if options.working_dir is None:
        return str(Path.cwd())
    folder = Path(options.working_dir).absolute()
    if not folder.is_dir():
        raise SweepError(f"--working-dir is not a folder: {folder}")
    if (folder / "flatland").is_dir():
        # Its sources have no extension.
        raise SweepError(
            f"--working-dir {folder} contains a folder flatland, which the workers would import "
            "instead of the installed package; choose a folder inside of it"
        )
    sys.path.insert(0, str(folder))  # as in the workers
    return str(folder)


def _world_path(world: str, options: argparse.Namespace, folder: str) -> str:
    """Returns what identifies a world file."""
    path = Path(folder, world)
    if not path.is_file():
        raise SweepError(f"world file not found: {path}")
    if options.working_dir is None:
        return str(path)
    if Path(world).is_absolute() or world.startswith(".."):
        raise SweepError(f"with --working-dir, paths must be relative to that folder, got {world}")
    return world


def _controller_hash(name: str, folder: str) -> str:
    """Returns what identifies a controller."""
    find_controller(name, folder)
    file = controller_file(name, folder)
    return "" if file is None else hashlib.sha256(file.read_bytes()).hexdigest()[:32]


@contextlib.contextmanager
def _sigterm_as_interrupt() -> Iterator[None]:
    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)


def _run_cells(
    cells: Sequence[Cell],
    total: int,
    settings: Settings,
    options: argparse.Namespace,
    results: Results,
) -> None:
    """Runs cells and stores their rows, also if this is interrupted."""
    from tqdm import tqdm

    if not cells:
        return
    errors, flushed = 0, time.monotonic()
    with (
        contextlib.closing(_rows(cells, settings, options)) as rows,
        tqdm(total=total, initial=total - len(cells), unit="cell", disable=None) as bar,
    ):
        try:
            for row in rows:
                results.add(row)
                errors += row["outcome"] == "error"
                if errors:
                    bar.set_postfix_str(f"errors: {errors}", refresh=False)
                bar.update()
                now = time.monotonic()
                if now - flushed >= _FLUSH_PERIOD or results.pending >= _MAX_PENDING:
                    results.flush()
                    flushed = now
        finally:
            results.flush()


def _rows(
    cells: Sequence[Cell], settings: Settings, options: argparse.Namespace
) -> Generator[Row, None, None]:
    folder = str(Path.cwd())
    if options.local:
        from flatland_sweep.local import run_locally

        yield from run_locally(cells, settings, folder, options.workers or os.cpu_count() or 1)
        return
    from flatland_sweep.cluster import connection, run_on_cluster

    working_dir = options.working_dir and str(Path(options.working_dir).absolute())
    with connection(options.address, options.workers, working_dir):
        yield from run_on_cluster(cells, settings, "" if working_dir else folder, options.workers)


def _report(results: Results) -> int:
    """Completes the results, prints the summary, and returns the exit code."""
    from flatland_sweep.summary import draw_summary, format_summary, summarize

    frame = results.complete()
    summary = summarize(frame)
    folder = results.folder
    summary.to_csv(folder / "summary.csv", index=False)
    is_drawn = draw_summary(frame, folder / "summary.png")
    print(format_summary(summary))
    print(
        f"\n{len(frame)} cells in {folder / 'results.parquet'}; {folder / 'summary.csv'}"
        + (f", {folder / 'summary.png'}" if is_drawn else "; no picture without matplotlib")
    )
    failed = frame[frame["outcome"] == "error"]
    for text, number in failed["error"].value_counts().head(5).items():
        print(f"sweep.py: {number} x {text}", file=sys.stderr)
    versions = frame.dropna(subset="inputs_hash").groupby("world")["inputs_hash"].nunique()
    for world in versions[versions > 1].index:
        print(
            f"sweep.py: {world}: its files have changed between the cells of this sweep",
            file=sys.stderr,
        )
    return _EXIT_ERRORS if len(failed) else 0
