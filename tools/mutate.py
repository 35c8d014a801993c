"""Measures which share of small defects the tests find, for `make mutate`.

Changes the program in one place at a time, at random, and runs the tests that mirror the changed
file. The changes are made in copies of the checkout in build/mutate. Prints the share of
changes that a test finds, and the others, each with its place and its difference. A test that
exceeds its time limit counts as a find; a change that is no valid program is replaced by another.

tools/mutate_equivalent.txt lists changes that no test can find, with the reason. They do not count.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import multiprocessing
import os
import queue
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from mutations import Mutation, mutations

_CHECKOUT = Path(__file__).resolve().parents[1]
_COPIES = _CHECKOUT / "build" / "mutate"
_EQUIVALENT = "tools/mutate_equivalent.txt"
# Variable of the environment of all programs that tests of a change start.
_MARK = "FLATLAND_MUTATION"
# What the build writes into the source tree, in addition to the files of git.
_BUILT = ("flatland/_core*.so", "flatland/msg/*.py", "flatland/srv/*.py", "flatland_msgs/**/*.py")


@dataclass(frozen=True)
class Room:
    """Sources, and the tests that mirror them, quick ones first.

    Attributes:
        sources: Patterns of the files that are changed.
        tests: Folders and files of tests, in addition to the file of tests that mirrors the source.
    """

    sources: tuple[str, ...]
    tests: tuple[str, ...]


# Rooms whose tests are not only those of tests/unit/ROOM. Headers in C++ are left out, except for
# those that a single source includes, since a change of another one requires a complete build.
_ROOMS = {
    "crowd": Room(
        ("src/cpp/crowd/*.cpp",),
        ("tests/unit/plugins/test_crowd_formulas.py", "tests/unit/plugins/test_pedestrians.py"),
    ),
    "loading": Room(
        ("flatland/loading/*.py",),
        (
            "tests/unit/loading",
            "tests/unit/plugin_api/test_missing_plugins.py",
            "tests/unit/bad_input",
            "tests/unit/cli/test_check_mistakes.py",
            "tests/unit/recording",
            "tests/unit/runtime/test_layer_set.py",
            "tests/unit/runtime/test_model_set.py",
        ),
    ),
    "node": Room(
        ("flatland/node/*.py",),
        (
            "tests/unit/node",
            "tests/unit/web/test_live_view.py",
            "tests/unit/ros/foreign_topics/test_drawers.py",
        ),
    ),
    "physics": Room(
        ("flatland/physics/*.py",),
        (
            "tests/unit/physics/test_bodies.py",
            "tests/unit/physics/test_contacts.py",
            "tests/unit/physics/test_joints.py",
            "tests/unit/physics/test_preconditions.py",
            "tests/unit/physics/test_materials.py",
            "tests/unit/physics/test_range_finder.py",
            "tests/unit/physics/test_raycast.py",
            "tests/unit/physics/test_overlap.py",
            "tests/unit/physics/test_copy.py",
            "tests/unit/physics/test_lifetime.py",
            "tests/unit/physics/test_boundaries.py",
            "tests/unit/physics/test_jammed_bodies.py",
            "tests/unit/test_repr.py",
            "tests/unit/test_world.py",
            "tests/unit/runtime/test_stepping.py",
        ),
    ),
    # In addition to the tests of each plugin.
    "plugins": Room(
        ("flatland/plugins/*.py",),
        (
            "tests/unit/plugins/test_after_step.py",
            "tests/unit/plugins/test_drive_odometry.py",
            "tests/unit/plugins/test_laser_noise.py",
            "tests/unit/plugins/test_force_mode.py",
            "tests/unit/plugins/test_moving_worlds.py",
            "tests/unit/plugins",
            "tests/unit/bad_input",
            "tests/unit/runtime/test_frame_senders.py",
        ),
    ),
    "rays": Room(
        ("src/cpp/rays/*.cpp", "src/cpp/rays/*_kernel.h"),
        (
            "tests/unit/physics/test_raycast.py",
            "tests/unit/physics/test_range_finder.py",
            "tests/unit/physics/test_materials.py",
            "tests/unit/plugins/test_laser.py",
            "tests/unit/plugins/test_laser_noise.py",
            "tests/unit/plugins/test_laser_materials.py",
            "tests/build/test_core_programs.py",
            "tests/unit/plugins/test_laser_batch.py",
            "tests/unit/plugins/test_moving_worlds.py",
            "tests/unit/physics",
            "tests/conformance",
        ),
    ),
    "ros": Room(
        (
            "flatland/ros/**/*.py",
            "flatland/node/adapters/*.py",
            "flatland/node/foreign_topics/*.py",
            "flatland/node/markers/*.py",
        ),
        (
            "tests/unit/ros",
            "tests/unit/cli/test_run.py",
            "tests/ros/adapters",
            "tests/ros/transport",
            "tests/ros/markers",
            "tests/ros/interactive",
            "tests/ros/test_msgs_package.py",
            "tests/ros/test_plugin_ros.py",
            "tests/ros/test_web_topics.py",
            "tests/ros/test_teleop.py",
            "tests/ros/test_start.py",
            "tests/ros/test_shutdown.py",
            "tests/ros/test_wall_time.py",
        ),
    ),
    "runtime": Room(
        ("flatland/runtime/*.py",),
        (
            "tests/unit/runtime/test_stepping.py",
            "tests/unit/runtime/test_model_set.py",
            "tests/unit/runtime/test_plugin_faults.py",
            "tests/unit/runtime/test_contact_dispatch.py",
            "tests/unit/runtime/test_observer.py",
            "tests/unit/runtime/test_requests.py",
            "tests/unit/runtime/test_layer_set.py",
            "tests/unit/runtime/test_model_moved.py",
            "tests/unit/runtime/test_frame_senders.py",
            "tests/unit/runtime/test_appearance.py",
            "tests/unit/runtime/test_body_monitor.py",
            "tests/unit/runtime/test_faults.py",
            "tests/unit/test_world.py",
            "tests/unit/test_sensors_world.py",
            "tests/unit/plugins/test_laser_batch.py",
            "tests/unit/gym/test_batch.py",
            "tests/unit/plugin_api/test_missing_plugins.py",
            "tests/unit/plugins/test_bumper.py",
            "tests/unit/bad_input/test_inputs.py",
            "tests/unit/runtime",
        ),
    ),
    "world": Room(
        ("src/cpp/world/*.cpp",),
        (
            "tests/unit/physics/test_bodies.py",
            "tests/unit/physics/test_contacts.py",
            "tests/unit/physics/test_joints.py",
            "tests/unit/physics",
            "tests/unit/plugins",
            "tests/unit/runtime/test_stepping.py",
            "tests/conformance",
        ),
    ),
}

_PYTHON_FUNCTION = re.compile(r"^ *(?:def|class) (\w+)", re.MULTILINE)
# The name that follows a type, at most within a class: `  static float name(`.
_CPP_FUNCTION = re.compile(r"^ {0,4}(?!return )(?:[\w:<>,&*]+ )+(?:\w+::)*(\w+)\(", re.MULTILINE)


@dataclass(frozen=True)
class Change:
    """One change of one file."""

    path: str
    line: int
    mutation: Mutation
    function: str = ""  # name of the function or class around it
    difference: tuple[str, ...] = ()  # the lines removed (-) and added (+), without indentation

    @property
    def key(self) -> tuple[str, str, tuple[str, ...]]:
        """What identifies the change, also after changes elsewhere in the file."""
        return self.path, self.function, self.difference


@dataclass(frozen=True)
class Result:
    """What the tests found about a change."""

    outcome: str  # "found", "timeout", "survived" or "invalid"
    output: str = ""


def room_of(name: str, checkout: Path) -> Room:
    """Returns the sources and tests of a room, or of a single file.

    Raises:
        ValueError: There is no such room or file.
    """
    if name in _ROOMS:
        return _ROOMS[name]
    path = checkout / name
    if path.is_file():
        parts = Path(name).parts
        folder = parts[2] if parts[:2] == ("src", "cpp") else parts[1]
        tests = _ROOMS[folder].tests if folder in _ROOMS else (f"tests/unit/{folder}",)
        return Room((name,), tests)
    if (checkout / "flatland" / name).is_dir():
        return Room((f"flatland/{name}/**/*.py",), (f"tests/unit/{name}",))
    raise ValueError(f"ROOM must be a folder of flatland/ or src/cpp/, or a file, got {name!r}")


def mirror(path: str, checkout: Path) -> list[str]:
    """Returns the files of tests that mirror a source, without those in tests/ros.

    They have the name of the source; without such a file, that of a module of the same room that
    imports the source.
    """
    source = checkout / path
    if source.suffix != ".py":
        # A C++ source has the name of a plugin in many cases.
        return _tests_named(source.stem, "", checkout)
    found = _tests_named(source.stem, source.parent.name, checkout)
    if not found:
        module = ".".join(Path(path).with_suffix("").parts)
        importers = (
            f for f in source.parent.glob("*.py") if f"from {module} import" in f.read_text()
        )
        for importer in sorted(importers):
            found += _tests_named(importer.stem, source.parent.name, checkout)
    return found


def _tests_named(stem: str, folder: str, checkout: Path) -> list[str]:
    files = (checkout / "tests" / "unit").rglob(f"test_{stem.removeprefix('_')}*.py")
    found = [file for file in files if folder in ("", *file.parts)]
    return [str(file.relative_to(checkout)) for file in sorted(found)]


def describe(path: str, text: str, mutation: Mutation) -> Change:
    """Returns a change with its line, its function and its difference."""
    lines = difflib.unified_diff(
        text.splitlines(), mutation.apply(text).splitlines(), lineterm="", n=0
    )
    difference = tuple(
        f"{line[0]} {line[1:].strip()}" for line in list(lines)[2:] if not line.startswith("@@")
    )
    pattern = _PYTHON_FUNCTION if path.endswith(".py") else _CPP_FUNCTION
    around = pattern.findall(text, 0, mutation.start)
    line = text.count("\n", 0, mutation.start) + 1
    return Change(path, line, mutation, around[-1] if around else "", difference)


def all_changes(room: Room, checkout: Path) -> list[list[Change]]:
    """Returns the changes of a room, in one list for each line that has any."""
    places: dict[tuple[str, int], list[Change]] = {}
    for path in sorted({path for pattern in room.sources for path in checkout.glob(pattern)}):
        name = str(path.relative_to(checkout))
        text = path.read_text(encoding="utf-8")
        for mutation in mutations(path, text):
            line = text.count("\n", 0, mutation.start) + 1
            places.setdefault((name, line), []).append(Change(name, line, mutation))
    return list(places.values())


def equivalents(text: str) -> dict[tuple[str, str, tuple[str, ...]], str]:
    """Returns the reasons of the changes that no test can find, by `Change.key`.

    Args:
        text: Paragraphs, each with the path of the file and the name of the function, the lines
            removed and added, and the reason. Lines that start with `#` are comments.
    """
    found: dict[tuple[str, str, tuple[str, ...]], str] = {}
    plain = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
    for paragraph in filter(None, map(str.strip, plain.split("\n\n"))):
        first, *rest = paragraph.splitlines()
        path, _, function = first.partition(" ")
        difference = tuple(line for line in rest if line.startswith(("- ", "+ ")))
        reason = " ".join(line for line in rest if line not in difference)
        found[path, function, difference] = reason
    return found


# Modules that most tests import, and none of the program. Each run of tests is a fork of a process
# that has imported them, which takes longer than many tests.
_FORKS = multiprocessing.get_context("forkserver")
_FORKS.set_forkserver_preload(["aiohttp", "cv2", "hypothesis", "lupa", "numpy", "pytest", "yaml"])
_PYTEST_OPTIONS = (
    *("-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=line"),
    *("-W", "ignore::pytest.PytestAssertRewriteWarning"),  # of the modules imported before
)


def _run_pytest(
    folder: Path, environment: dict[str, str], arguments: list[str], log: Path
) -> NoReturn:
    """Runs tests in a copy, in a process of their own.

    Args:
        folder: The copy.
        environment: Environment variables.
        arguments: Arguments of pytest.
        log: File to which the process writes.
    """
    os.setsid()
    os.chdir(folder)
    os.environ.update(environment)
    sys.path[:0] = environment["PYTHONPATH"].split(os.pathsep)
    # Files of the same size and second would be mistaken for the compiled ones.
    sys.dont_write_bytecode = True
    output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for number in (1, 2):
        os.dup2(output, number)
    import pytest

    sys.exit(pytest.main(arguments))


class Copy:
    """A copy of the checkout, in which the program is changed and its tests run.

    Args:
        folder: Folder of the copy. What it already contains is updated.
        compile_core: Whether the extension is built in the copy.
    """

    def __init__(self, folder: Path, compile_core: bool) -> None:
        self.folder = folder
        tracked = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],  # noqa: S607
            cwd=_CHECKOUT,
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split("\0")
        built = [str(f.relative_to(_CHECKOUT)) for p in _BUILT for f in _CHECKOUT.glob(p)]
        wanted = {name for name in filter(None, tracked) if (_CHECKOUT / name).exists()}
        wanted |= {name for name in built if not (compile_core and name.endswith(".so"))}
        for path in list(folder.rglob("*")) if folder.exists() else []:
            name = path.relative_to(folder)
            kept = name.parts[0] in ("build", ".venv") or path.suffix in (".so", ".pyc")
            if not kept and str(name) not in wanted and not path.is_dir():
                path.unlink()
        for name in sorted(wanted):
            source, target = _CHECKOUT / name, folder / name
            plain = target.is_file() and not target.is_symlink()
            if plain and source.read_bytes() == target.read_bytes():
                continue  # keeps the time of the file, for incremental builds
            target.parent.mkdir(parents=True, exist_ok=True)
            target.unlink(missing_ok=True)
            shutil.copyfile(source, target, follow_symlinks=False)
            if not target.is_symlink():
                shutil.copymode(source, target)
        if not (folder / ".venv").exists():
            (folder / ".venv").symlink_to(_CHECKOUT / ".venv")
        self._environment = {
            "FLATLAND_SHARED_DIR": str(_CHECKOUT.parent / "shared"),
            **os.environ,
            "PYTHONPATH": f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
            "PYTHONDONTWRITEBYTECODE": "1",
            "CCACHE_BASEDIR": str(folder),
            _MARK: str(folder),
        }
        if compile_core:
            (folder / "build").mkdir(exist_ok=True)
            self._run(["cmake", "--preset", "dev"], check=True)
            self.build(check=True)
        compiled = ["-m", "compileall", "-q", "--invalidation-mode", "checked-hash", "flatland"]
        self._run([sys.executable, *compiled], check=True)

    def build(self, check: bool = False) -> bool:
        """Builds the extension after a change of its sources; returns whether that succeeded."""
        return self._run(["cmake", "--build", "build/dev"], check=check) is not None

    def test(self, tests: Sequence[str], limit: float) -> Result:
        """Runs tests until one fails.

        Args:
            tests: Files and folders.
            limit: Time after which the tests are ended [s].
        """
        log = self.folder / "build" / "tests.log"
        log.parent.mkdir(exist_ok=True)
        arguments = (self.folder, self._environment, [*_PYTEST_OPTIONS, *tests], log)
        process = _FORKS.Process(target=_run_pytest, args=arguments)
        process.start()
        process.join(limit)
        code = process.exitcode
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid or 0, signal.SIGKILL)
        process.join()
        # Not at the top: the processes of the tests import this file, and flatland from the copy.
        from flatland.scenarios.programs import end_marked

        # Programs that the tests have started are in groups of their own.
        end_marked(str(self.folder), _MARK)
        if code is None:
            return Result("timeout")
        text = log.read_text(errors="replace")
        # 5: no tests, which a changed room never is.
        return Result("survived" if code == 0 else "found", text)

    def try_change(self, change: Change, stages: Sequence[Sequence[str]], limit: float) -> Result:
        """Makes a change, runs the tests and reverts the change."""
        path = self.folder / change.path
        text = path.read_text(encoding="utf-8")
        changed = change.mutation.apply(text)
        is_python = path.suffix == ".py"
        if is_python:
            try:
                compile(changed, change.path, "exec")
            except SyntaxError:
                return Result("invalid")
        path.write_text(changed, encoding="utf-8")
        try:
            if not is_python and not self.build():
                return Result("invalid")
            result = Result("survived")
            for stage in stages:
                result = self.test(stage, limit)
                if result.outcome != "survived":
                    break
            return result
        finally:
            path.write_text(text, encoding="utf-8")

    def _run(self, command: list[str], check: bool) -> str | None:
        """Runs a program of the build; returns its output, or None if it failed.

        Raises:
            RuntimeError: It failed, and `check` is set.
        """
        done = subprocess.run(  # noqa: S603 - CMake
            command,
            cwd=self.folder,
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode and check:
            raise RuntimeError(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
        return None if done.returncode else done.stdout


def measure(name: str, options: argparse.Namespace) -> tuple[int, int]:
    """Tries changes of a room, and prints what the tests found.

    Returns:
        Number of changes found, and of changes that count.
    """
    room = room_of(name, _CHECKOUT)
    places = all_changes(room, _CHECKOUT)
    generator = random.Random(f"{options.seed} {name}")  # noqa: S311
    generator.shuffle(places)
    drawn = [generator.choice(place) for place in places]
    known = equivalents((_CHECKOUT / _EQUIVALENT).read_text(encoding="utf-8"))
    compile_core = any(change.path.startswith("src/") for change in drawn)
    copies: queue.SimpleQueue[Copy] = queue.SimpleQueue()
    _COPIES.mkdir(parents=True, exist_ok=True)
    (_COPIES / "CATKIN_IGNORE").touch()  # A workspace would find the packages of the copies.
    for number in range(options.jobs):
        folder = f"{'cpp' if compile_core else 'python'}-{number}"
        copies.put(Copy(_COPIES / folder, compile_core))

    copy = copies.get()
    started = time.monotonic()
    baseline = copy.test(room.tests, 3600.0)
    elapsed = time.monotonic() - started
    copies.put(copy)
    if baseline.outcome != "survived":
        raise RuntimeError(f"the tests fail without a change:\n{baseline.output[-2000:]}")
    limit = 20.0 + 3.0 * elapsed
    print(
        f"{name}: {len(places)} places, tests take {elapsed:.0f} s, seed {options.seed}", flush=True
    )

    def attempt(change: Change) -> tuple[Change, Result]:
        copy = copies.get()
        try:
            mirrored = mirror(change.path, _CHECKOUT)
            return change, copy.try_change(change, [s for s in (mirrored, room.tests) if s], limit)
        finally:
            copies.put(copy)

    counts = dict.fromkeys(("found", "timeout", "survived", "equivalent", "invalid"), 0)
    remaining = iter(drawn)
    with ThreadPoolExecutor(options.jobs) as pool:
        while True:
            missing = options.number - counts["found"] - counts["timeout"] - counts["survived"]
            batch = []
            for change in remaining:
                text = (_CHECKOUT / change.path).read_text(encoding="utf-8")
                described = describe(change.path, text, change.mutation)
                if described.key in known:
                    counts["equivalent"] += 1
                else:
                    batch.append(described)
                if len(batch) >= missing:
                    break
            if missing <= 0 or not batch:
                break
            for change, result in pool.map(attempt, batch):
                counts[result.outcome] += 1
                report(change, result, options.verbose)
    found = counts["found"] + counts["timeout"]
    counted = found + counts["survived"]
    share = 100.0 * found / counted if counted else 100.0
    details = ", ".join(f"{number} {outcome}" for outcome, number in counts.items() if number)
    print(f"{name}: {found} of {counted} found, {share:.0f} % ({details})\n", flush=True)
    return found, counted


def report(change: Change, result: Result, verbose: bool) -> None:
    """Prints a change that survived; with `verbose` each change, with the test that found it."""
    if result.outcome != "survived" and not verbose:
        return
    where = f"{change.path}:{change.line} in {change.function or 'the file'}"
    print(f"{result.outcome}: {where} ({change.mutation.kind})")
    print(*(f"    {line}" for line in change.difference), sep="\n")
    if result.outcome == "found":
        failed = [
            line for line in result.output.splitlines() if line.startswith(("FAILED", "ERROR"))
        ]
        print(*(f"    {line[:160]}" for line in failed), sep="\n")
    sys.stdout.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Tries changes of the given rooms; returns the exit code, 1 if fewer than 95 % were found."""
    parser = argparse.ArgumentParser(prog="make mutate", description=__doc__)
    default = ("runtime", "node", "ros", "loading", "plugins", "physics", "rays", "world")
    parser.add_argument(
        "rooms",
        nargs="*",
        default=default,
        metavar="ROOM",
        help="folder of flatland/ or src/cpp/, or a source file (default: %(default)s)",
    )
    parser.add_argument("--number", type=int, default=40, help="changes of each room (%(default)s)")
    parser.add_argument("--seed", type=int, help="selects the changes; random by default")
    parser.add_argument("--jobs", type=int, default=1, help="copies that run tests (%(default)s)")
    parser.add_argument("--verbose", action="store_true", help="also print changes that were found")
    options = parser.parse_args(arguments)
    if options.seed is None:
        options.seed = random.SystemRandom().randrange(10_000)
    try:
        shares = [measure(name, options) for name in options.rooms]
    except (RuntimeError, ValueError) as error:
        print(f"mutate: {error}", file=sys.stderr)
        return 2
    return 0 if all(found >= 0.95 * counted for found, counted in shares) else 1


if __name__ == "__main__":
    sys.exit(main())
