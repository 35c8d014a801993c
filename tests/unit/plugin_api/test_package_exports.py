"""The search of packages on `ROS_PACKAGE_PATH` and its cache."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from flatland.plugin_api import package_exports
from flatland.plugin_api.package_exports import Export

LONG_AGO = 1_000_000_000  # s, a modification time far in the past


def package(name: str, exports: str) -> str:
    return f"<package><name>{name}</name><export>{exports}</export></package>"


def exported(tag: str = "flatland") -> str:
    return f'<{tag} plugin="${{prefix}}/p.xml"/>'


@pytest.fixture
def search(files, monkeypatch):
    """Returns a function that writes files, sets old times, and returns the exports of folders."""

    def search_folders(contents, folders=(".",)):
        for path, text in contents.items():
            files.write(path, text)
        age(files.folder)
        roots = [str(files.folder / folder) for folder in folders]
        monkeypatch.setenv("ROS_PACKAGE_PATH", ":".join(roots))
        return package_exports.package_exports()

    return search_folders


def age(folder: Path) -> None:
    """Sets an old modification time for a folder and its contents."""
    for path in [*folder.rglob("*"), folder]:
        os.utime(path, (LONG_AGO, LONG_AGO))


def names(found) -> list[str]:
    return [export.package for export in found.exports]


def test_exports_of_both_tags(search, files):
    found = search(
        {
            "a/package.xml": package("first", exported()),
            "b/deep/package.xml": package("second", exported("flatland_server") + exported()),
            "c/package.xml": package("third", '<rviz plugin="x.xml"/><flatland/>'),
        }
    )
    folder = files.folder
    assert found.exports == (
        Export("first", "flatland", f"{folder}/a/p.xml"),
        Export("second", "flatland_server", f"{folder}/b/deep/p.xml"),
        Export("second", "flatland", f"{folder}/b/deep/p.xml"),
    )
    assert found.problems == ()


@pytest.mark.parametrize(
    ("contents", "expected"),
    [
        ({"a/CATKIN_IGNORE": "", "a/package.xml": package("a", exported())}, []),
        ({"a/CATKIN_IGNORE": "", "a/b/package.xml": package("b", exported())}, []),
        ({"a/rospack_nosubdirs": "", "a/b/package.xml": package("b", exported())}, []),
        ({".hidden/package.xml": package("a", exported())}, []),
        ({"a/package.xml": package("a", ""), "a/b/package.xml": package("b", exported())}, []),
        ({"a/manifest.xml": f"<package><export>{exported()}</export></package>"}, ["a"]),
        ({"a/package.xml": package("flatland", exported())}, []),
        ({"a/package.xml": package("x", exported()), "b/package.xml": package("x", exported())},
         ["x"]),
    ],
)  # fmt: skip
def test_packages_are_found_by_the_rules_of_rospack(search, contents, expected):
    assert names(search(contents)) == expected


def test_a_package_hides_later_ones_of_the_same_name(search):
    contents = {
        "over/x/package.xml": package("x", ""),
        "under/x/package.xml": package("x", exported()),
        "under/y/package.xml": package("y", exported()),
    }
    assert names(search(contents, ["over", "under"])) == ["y"]
    assert names(search(contents, ["under", "over"])) == ["x", "y"]


def test_cyclic_links_are_followed_once(search, files):
    files.write("a/package.xml", package("a", exported()))
    (files.folder / "b").mkdir()
    (files.folder / "b" / "up").symlink_to(files.folder)
    assert names(search({})) == ["a"]


def test_a_package_file_that_is_not_xml_is_reported(search, files):
    contents = {
        "a/package.xml": "<package><name>a</name><flatland",
        "b/package.xml": "<package><name>b</name><broken, but no plugins",
        "c/package.xml": package("c", exported()),
    }
    found = search(contents)
    (problem,) = found.problems
    assert str(problem) == (
        f'Flatland plugin: "{files.folder}/a/package.xml" is not XML, '
        "unclosed token: line 1, column 23"
    )
    assert names(found) == ["c"]


@pytest.mark.parametrize("encoding", ["utf-9", "gb2312"])
def test_a_package_file_in_an_unknown_encoding_is_reported(search, files, encoding):
    contents = {
        "a/package.xml": f'<?xml version="1.0" encoding="{encoding}"?>' + package("a", exported()),
        "c/package.xml": package("c", exported()),
    }
    found = search(contents)
    (problem,) = found.problems
    path = files.folder / "a" / "package.xml"
    assert str(problem).startswith(f'Flatland plugin: "{path}" cannot be read: ')
    assert names(found) == ["c"]


def test_an_empty_path_and_missing_folders_have_no_exports(search, monkeypatch):
    assert names(search({}, ["absent"])) == []
    for value in ("", ":"):
        monkeypatch.setenv("ROS_PACKAGE_PATH", value)
        assert names(package_exports.package_exports()) == []
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    assert names(package_exports.package_exports()) == []


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda folder: (folder / "new").mkdir(), ["a"]),
        (lambda folder: (folder / "b" / "package.xml").write_text(package("b", exported())),
         ["a", "b"]),
        (lambda folder: (folder / "a" / "package.xml").write_text(package("z", exported())), ["z"]),
        (lambda folder: (folder / "a" / "package.xml").unlink(), []),
        (lambda folder: (folder / "a" / "CATKIN_IGNORE").touch(), []),
    ],
)  # fmt: skip
def test_a_change_of_a_folder_or_package_file_repeats_the_search(search, files, change, expected):
    assert names(search({"a/package.xml": package("a", exported()), "b/x": ""})) == ["a"]
    change(files.folder)
    assert names(package_exports.package_exports()) == expected


def test_a_change_right_after_a_search_repeats_the_search(search, files):
    """With a coarse clock, the change may not affect the modification time of the folder."""
    search({"a/x": ""})
    (files.folder / "a" / "package.xml").write_text(package("a", exported()))
    now = (files.folder / "a").stat().st_mtime_ns
    assert names(package_exports.package_exports()) == ["a"]
    (files.folder / "a" / "CATKIN_IGNORE").touch()
    os.utime(files.folder / "a", ns=(now, now))
    assert names(package_exports.package_exports()) == []
