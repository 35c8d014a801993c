"""The command `flatland` as a whole: help, version, broken pipes."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree

import pytest
from flatland_command import main, run

import flatland
from flatland.cli import arguments


class TestBrokenPipe:
    @pytest.mark.parametrize(
        "arguments",
        [["check", "world.yaml"], ["check", "minimal.model.yaml"], ["--version"], ["--help"],
         ["show", "--help"]],
    )  # fmt: skip
    def test_output_without_a_reader(self, world_file, tmp_path, arguments):
        done = run_into_broken_pipe(arguments, tmp_path, stderr=subprocess.PIPE)
        assert (done.returncode, done.stderr) == (141, b"")

    @pytest.mark.parametrize("command", ["check", "show"])
    def test_errors_without_a_reader(self, tmp_path, command):
        options = ["-o", "a.png"] if command == "show" else []
        arguments = [command, "nowhere.yaml", *options]
        done = run_into_broken_pipe(arguments, tmp_path, stderr=subprocess.STDOUT)
        assert done.returncode == 141

    def test_in_a_shell(self, world_file):
        command = f'"{sys.executable}" -m flatland check "{world_file}" | head -1; ' + (
            'echo "${PIPESTATUS[1]}"'
        )
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
        assert done.stdout.splitlines() == [f"{world_file}: no errors", "0"]
        assert done.stderr == ""


def run_into_broken_pipe(arguments, folder, **options):
    """Runs the command with an output pipe whose reading end is closed."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        command = [sys.executable, "-m", "flatland", *arguments]
        return subprocess.run(
            command, stdout=writing, cwd=folder, timeout=60, check=False, **options
        )
    finally:
        os.close(writing)


def test_version_equals_that_of_the_packages(checkout):
    project = tomllib.loads((checkout / "pyproject.toml").read_text())["project"]
    package = ElementTree.parse(checkout / "package.xml").getroot()
    assert flatland.__version__ == project["version"] == package.findtext("version")
    assert project["scripts"]["flatland"] == "flatland.cli:main"
    done = run("--version")
    assert (done.returncode, done.stdout) == (0, f"flatland {flatland.__version__}\n")


def test_help_lists_the_commands(capsys):
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    with pytest.raises(SystemExit):
        main("--help")
    text = capsys.readouterr().out
    assert "show" in text
    assert "check" in text


def test_values_of_parameters_are_yaml():
    values = {"1": 1, "0.5": 0.5, "true": True, "a b": "a b", "": "", "a=b": "a=b"}
    for text, value in values.items():
        assert arguments.parameter(f"/x={text}") == ("/x", value)
