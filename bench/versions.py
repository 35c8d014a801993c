"""Versions of flatland that are compared: this one, and builds of other commits."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path

from scenes import CHECKOUT

BUILDS = CHECKOUT / "build" / "versions"


@dataclass(frozen=True, slots=True)
class Version:
    """An installed version of flatland.

    All versions use the interpreter and the other packages of this environment.

    Attributes:
        name: Name in tables.
        prefix: Folder that contains `lib` and `share`.
    """

    name: str
    prefix: Path

    @property
    def variables(self) -> dict[str, str]:
        """The environment variables by which programs import this version."""
        base = str(self.prefix)
        site = sysconfig.get_path("platlib", vars={"base": base, "platbase": base})
        others = [path for path in os.environ.get("PYTHONPATH", "").split(":") if path]
        return {
            "PYTHONPATH": ":".join([site, *others]),
            "ROS_PACKAGE_PATH": f"{base}/share:/usr/share",
        }

    @property
    def office(self) -> Path:
        """The folder of the bundled office."""
        return self.prefix / "share" / "flatland" / "worlds" / "office"


def installed() -> Version:
    """Returns the version that `make setup` has installed."""
    return Version("this", Path(sys.prefix))


def build(ref: str) -> Version:
    """Builds a commit in a folder of its own, unless it is there already.

    Args:
        ref: Name of the commit.

    Raises:
        ValueError: The commit does not exist.
        subprocess.CalledProcessError: The commit cannot be built.
    """
    found = subprocess.run(
        ["git", "rev-parse", "--verify", "--quiet", f"{ref}^{{commit}}"],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
    )
    if found.returncode:
        raise ValueError(f"{ref} is not a commit of {CHECKOUT}")
    commit = found.stdout.strip()
    folder = BUILDS / commit
    if not folder.exists():
        print(f"building {ref} in {folder}", flush=True)
        incomplete = BUILDS / f"{commit}.incomplete"
        shutil.rmtree(incomplete, ignore_errors=True)
        _install(commit, incomplete)
        incomplete.rename(folder)
    return Version(ref, folder)


def _install(commit: str, prefix: Path) -> None:
    """Installs a commit into a prefix."""
    source = prefix / "source"
    environment = dict(os.environ)
    environment.pop("PYTHONPATH", None)
    if shutil.which("ccache"):
        environment["CMAKE_CXX_COMPILER_LAUNCHER"] = "ccache"
    options = ["--no-deps", "--no-build-isolation", "--ignore-installed", "--quiet"]
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", *options]
    for command in (
        ["git", "clone", "--quiet", "--shared", "--no-checkout", str(CHECKOUT), str(source)],
        ["git", "-C", str(source), "checkout", "--quiet", "--detach", commit],
        [*pip, "--prefix", str(prefix), str(source)],
    ):
        subprocess.run(command, check=True, env=environment)
