"""Runs all fuzz targets, one after the other: run.py [--duration SECONDS] [TARGET...].

Each target has a corpus in build/fuzz/corpus, which grows with each run, beside the inputs of
tests/fuzz/corpus. Inputs that fail are written to build/fuzz/findings. The exit code is 1 if there
are any.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from fuzz_targets import TARGETS

CHECKOUT = Path(__file__).resolve().parents[2]
BUILD = CHECKOUT / "build" / "fuzz"
SEEDS = CHECKOUT / "tests" / "fuzz" / "corpus"
# Parts of the total time; 1 for each target that is not listed.
SHARES = {"physics": 4, "jams": 2}
NAMES = (*TARGETS, *SHARES)
# Limits of one input. Instrumented code is several times as slow, and the memory of the process is
# included.
SECONDS, MEGABYTES, BYTES = 10, 600, 4096
MORE_BYTES = {"preprocessor": 16_384, "image": 16_384, "map": 16_384}
# Files of the checkout from which a target starts, in addition to its corpus.
BUNDLED = {
    "yaml": ("worlds/*/*.yaml",),
    "preprocessor": ("worlds/*/*.yaml",),
    "manifest": ("flatland/plugins/*.xml", "examples/*/*.xml"),
    "package": ("catkin/*/package.xml", "compat/*/package.xml", "examples/*/package.xml"),
    "segments": ("worlds/*/*.dat",),
}


def bundled_files(name: str) -> Path:
    """Returns a folder with copies of the bundled files for a target."""
    folder = BUILD / "bundled" / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    paths = sorted(path for pattern in BUNDLED.get(name, ()) for path in CHECKOUT.glob(pattern))
    for number, path in enumerate(paths):
        shutil.copyfile(path, folder / f"{number}_{path.name}")
    return folder


def fuzz_reader(name: str, seconds: int) -> tuple[int, str]:
    """Runs one target of atheris; returns the exit code and a summary."""
    corpus, findings = BUILD / "corpus" / name, BUILD / "findings" / name
    for folder in (corpus, findings):
        folder.mkdir(parents=True, exist_ok=True)
    command = [
        *(sys.executable, str(Path(__file__).with_name("target.py")), name),
        f"-max_total_time={seconds}",
        f"-max_len={MORE_BYTES.get(name, BYTES)}",
        f"-timeout={SECONDS}",
        f"-rss_limit_mb={MEGABYTES}",
        f"-artifact_prefix={findings}/",
        "-print_final_stats=1",
        *map(str, (corpus, SEEDS / name, bundled_files(name))),
    ]
    log = BUILD / f"{name}.log"
    with log.open("w") as file:
        result = subprocess.run(command, check=False, stdout=file, stderr=subprocess.STDOUT)
    text = log.read_text(errors="replace")
    if result.returncode:
        print(text[-4000:])
        return result.returncode, f"failed, see {log}"
    stats = dict(re.findall(r"stat::(\w+): +(\d+)", text))
    inputs, memory = stats["number_of_executed_units"], stats["peak_rss_mb"]
    return 0, f"{inputs} inputs, at most {memory} MB"


def fuzz_physics(seconds: int) -> tuple[int, str]:
    """Calls the physics engine at random; returns the exit code and a summary."""
    command = [sys.executable, str(Path(__file__).with_name("physics.py")), str(seconds)]
    result = subprocess.run(command, check=False, stdout=subprocess.PIPE, text=True)
    lines = result.stdout.replace("\r", "\n").splitlines()
    if result.returncode:
        print("\n".join(lines[-20:]))
        return result.returncode, f"failed with {lines[-1] if lines else 'no output'}"
    return 0, " ".join(lines[-2:])


def fuzz_jams(seconds: int) -> tuple[int, str]:
    """Draws jammed bodies, a few at a time; returns the exit code and a summary."""
    tests = "tests/unit/physics/test_jammed_bodies.py"
    command = [sys.executable, "-m", "pytest", "-q", "--timeout", "0", "-p", "no:cacheprovider"]
    end, runs = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        result = subprocess.run(
            [*command, tests],
            check=False,
            cwd=CHECKOUT,
            env={**os.environ, "FLATLAND_FUZZ": "10"},
            stdout=subprocess.PIPE,
            text=True,
        )
        runs += 1
        if result.returncode:
            print(result.stdout[-4000:])
            return result.returncode, f"failed, {tests}"
    return 0, f"{30 * runs} jams"


def main() -> int:
    """Runs the targets and prints a table; returns 1 after a failure."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--duration", type=float, default=600, help="seconds of all targets")
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of {', '.join(NAMES)}")
    arguments = parser.parse_args()
    names = arguments.targets or NAMES
    if unknown := set(names) - set(NAMES):
        parser.error(f"unknown target {', '.join(sorted(unknown))}, choose from {', '.join(NAMES)}")
    second = arguments.duration / sum(SHARES.get(name, 1) for name in names)
    failures = 0
    for name in names:
        seconds = max(1, round(second * SHARES.get(name, 1)))
        start = time.monotonic()
        if name == "physics":
            code, summary = fuzz_physics(seconds)
        elif name == "jams":
            code, summary = fuzz_jams(seconds)
        else:
            code, summary = fuzz_reader(name, seconds)
        failures += code != 0
        print(f"{name:14} {time.monotonic() - start:5.0f} s  {summary}", flush=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
