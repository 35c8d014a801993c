"""Finds the plugin manifests exported by packages on `ROS_PACKAGE_PATH`.

Packages are found by the rules of rospack, but a package file without the word `flatland` is not
parsed. The result is cached until a folder or file changes.
"""

from __future__ import annotations

import os
import re
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from flatland.errors import PluginError

PYTHON_TAG = "flatland"
REFERENCE_TAG = "flatland_server"
_PACKAGE_FILES = ("package.xml", "manifest.xml")
_NAME = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
# File systems store times with a resolution of up to two seconds: within it, a folder may change
# without a new modification time.
_TIME_RESOLUTION = 2_000_000_000  # ns


@dataclass(frozen=True, slots=True)
class Export:
    """A manifest exported by a package.

    Attributes:
        package: Name of the package.
        tag: `flatland` or, for plugins of the reference, `flatland_server`.
        manifest: Path of the manifest.
    """

    package: str
    tag: str
    manifest: str


@dataclass(frozen=True, slots=True)
class PackageExports:
    """The exports of all packages on a package path.

    Attributes:
        exports: Exported manifests in the order of the path.
        problems: Errors of package files that cannot be read or are not XML.
    """

    exports: tuple[Export, ...]
    problems: tuple[PluginError, ...]


@dataclass(frozen=True, slots=True)
class _Scan:
    """The result of one search, with the modification times of all files that it depends on."""

    package_path: str
    result: PackageExports
    times: dict[str, int | None]
    is_settled: bool

    def is_current(self, package_path: str) -> bool:
        return (
            self.is_settled
            and self.package_path == package_path
            and all(modification_time(path) == then for path, then in self.times.items())
        )


_last_scan = _Scan("", PackageExports((), ()), {}, True)


def package_exports() -> PackageExports:
    """Returns the current exports of the packages on `ROS_PACKAGE_PATH`.

    The packages are searched again only if the variable, a folder or a package file has changed
    since the last call in this process.
    """
    global _last_scan
    package_path = os.environ.get("ROS_PACKAGE_PATH", "")
    scan = _last_scan
    if not scan.is_current(package_path):
        scan = _last_scan = _search(package_path)
    return scan.result


def modification_time(path: str) -> int | None:
    """Returns the modification time of a file or folder [ns], None if it cannot be read."""
    try:
        return os.stat(path).st_mtime_ns  # noqa: PTH116  (half the time of a Path)
    except OSError:
        return None


def are_settled(times: Mapping[str, int | None], moment: int) -> bool:
    """Returns whether any later change of the files and folders changes their modification time.

    Args:
        times: Modification times [ns], as returned by `modification_time`.
        moment: System time [ns] at which the times were read, or an earlier one.
    """
    newest = max((moment for moment in times.values() if moment is not None), default=0)
    return newest < moment - _TIME_RESOLUTION


def _search(package_path: str) -> _Scan:
    start = time.time_ns()
    times: dict[str, int | None] = {}
    exports: list[Export] = []
    problems: list[PluginError] = []
    names: set[str] = set()
    for package_file in _package_files(package_path, times):
        path = Path(package_file)
        folder = str(path.parent)
        try:
            content = path.read_bytes()
        except OSError as error:
            problems.append(PluginError(f'"{package_file}" cannot be read: {error.strerror}'))
            continue
        found = _NAME.search(content)
        name = found[1].decode(errors="replace") if found else path.parent.name
        if name in names:
            continue
        names.add(name)
        if b"flatland" not in content or name == "flatland":
            continue
        try:
            # Trusted input: part of the installation, like the code of the plugins.
            root = ElementTree.fromstring(content)  # noqa: S314
        except ElementTree.ParseError as error:
            problems.append(PluginError(f'"{package_file}" is not XML, {error}'))
            continue
        except (LookupError, ValueError) as error:  # an encoding that is not supported
            problems.append(PluginError(f'"{package_file}" cannot be read: {error}'))
            continue
        exports += [
            Export(name, element.tag, element.get("plugin", "").replace("${prefix}", folder))
            for element in root.iterfind("export/*[@plugin]")
            if element.tag in (PYTHON_TAG, REFERENCE_TAG)
        ]
    result = PackageExports(tuple(exports), tuple(problems))
    return _Scan(package_path, result, times, are_settled(times, start))


def _package_files(package_path: str, times: dict[str, int | None]) -> Iterator[str]:
    """Iterates over the package files below the folders of a package path.

    Args:
        package_path: Folders, separated by colons.
        times: Receives the modification time of each folder and package file.
    """
    searched = set()
    pending = [root for root in reversed(package_path.split(":")) if root]
    while pending:
        folder = pending.pop()
        try:
            status = os.stat(folder)  # noqa: PTH116
        except OSError:
            times[folder] = None
            continue
        if (status.st_dev, status.st_ino) in searched:  # symbolic links may form a loop
            continue
        searched.add((status.st_dev, status.st_ino))
        times[folder] = status.st_mtime_ns
        if modification_time(f"{folder}/CATKIN_IGNORE") is not None:
            continue
        for package_file in (f"{folder}/{name}" for name in _PACKAGE_FILES):
            moment = modification_time(package_file)
            if moment is not None:
                times[package_file] = moment
                yield package_file
                break
        else:
            pending += _subfolders(folder)


def _subfolders(folder: str) -> list[str]:
    """Returns the folders to search next, in reverse order."""
    # Debian installs packages directly in /usr/share, beside folders with thousands of files.
    if folder.startswith("/usr/share/"):
        return []
    try:
        with os.scandir(folder) as found:
            entries = list(found)
    except OSError:
        return []
    if any(entry.name == "rospack_nosubdirs" for entry in entries):
        return []
    names = [entry.name for entry in entries if entry.name[0] != "." and entry.is_dir()]
    return [f"{folder}/{name}" for name in sorted(names, reverse=True)]
