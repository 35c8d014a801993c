"""The command `flatland` as a whole: help, version, broken pipes."""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree

import pytest
from flatland_command import main
from programs import run_program

import flatland
from flatland.cli import arguments
from flatland.cli.main import make_parser


class TestBrokenPipe:
    def test_output_without_a_reader(self, world_file, tmp_path):
        done = run_into_broken_pipe(["check", world_file], tmp_path, stderr=subprocess.PIPE)
        assert (done.returncode, done.stderr) == (141, "")

    def test_errors_without_a_reader(self, tmp_path):
        arguments = ["check", "nowhere.yaml"]
        done = run_into_broken_pipe(arguments, tmp_path, stderr=subprocess.STDOUT)
        assert done.returncode == 141


def run_into_broken_pipe(arguments, folder, **options):
    """Runs the command with an output pipe whose reading end is closed."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        command = [sys.executable, "-m", "flatland", *arguments]
        return run_program(command, stdout=writing, cwd=folder, **options)
    finally:
        os.close(writing)


def test_version_equals_that_of_the_packages(checkout, capsys):
    project = tomllib.loads((checkout / "pyproject.toml").read_text())["project"]
    package = ElementTree.parse(checkout / "catkin" / "flatland" / "package.xml").getroot()
    assert flatland.__version__ == package.findtext("version")
    assert project["dynamic"] == ["version"]  # of flatland/version.py
    assert project["scripts"]["flatland"] == "flatland.cli:main"
    with pytest.raises(SystemExit) as caught:
        main("--version")
    assert (caught.value.code, capsys.readouterr().out) == (0, f"flatland {flatland.__version__}\n")


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


def test_completion(tmp_path):
    """Answers the shell as argcomplete requires: the words are written to file descriptor 8."""
    done = run_program(
        ["bash", "-c", f'"{sys.executable}" -m flatland 8>&1 9>/dev/null >/dev/null'],
        env={
            **os.environ,
            "_ARGCOMPLETE": "1",
            "_ARGCOMPLETE_IFS": "\n",
            "_ARGCOMPLETE_SHELL": "bash",
            "COMP_LINE": "flatland d",
            "COMP_POINT": "10",
            "COMP_TYPE": "9",
        },
    )
    assert done.stdout.split() == ["doctor"]


def test_interruption_ends_without_a_traceback(monkeypatch, capsys):
    def interrupt(_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("flatland.cli.show._show", interrupt)
    assert main("show", "w.yaml", "-o", "a.png") == 130
    assert capsys.readouterr().err == "flatland: interrupted\n"


COMMANDS = ("check", "info", "show", "run", "view", "replay", "test", "new", "doctor")


def subparser(name: str) -> argparse.ArgumentParser:
    """Returns the parser of a command."""
    actions = make_parser()._subparsers._group_actions  # type: ignore[union-attr]
    parser: argparse.ArgumentParser = actions[0].choices[name]
    return parser


def example_commands() -> list[str]:
    """Returns the examples in the help of all commands."""
    commands = []
    for name in COMMANDS:
        helped = subparser(name).format_help()
        examples = helped.split("examples:\n")[1].strip().splitlines()
        assert examples, name
        commands += [example.strip() for example in examples]
    return commands


# test_doctor.py runs those of `flatland doctor`.
@pytest.mark.parametrize(
    "example", [text for text in example_commands() if not text.startswith("flatland doctor")]
)
def test_the_examples_of_the_help_run(checkout, tmp_path, monkeypatch, capsys, example):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "worlds").mkdir()
    (tmp_path / "worlds" / "office").symlink_to(checkout / "worlds" / "office")
    command, *words = shlex.split(example)
    assert command == "flatland"
    if words[0] == "replay":
        world = tmp_path / "worlds" / "office" / "world.yaml"
        assert main("run", world, "--duration", "0.1", "--record", words[1]) == 0
    if words[0] == "run":
        words += ["--duration", "0.1"]
    if words[0] == "test":  # test_test.py runs suites
        scenario = tmp_path / "my" / "scenarios" / "s.yaml"
        scenario.parent.mkdir(parents=True)
        scenario.write_text("{world: ../../worlds/office/world.yaml, goal: [1, 1]}")
        words += ["--list"]
    if words[0] == "view":  # neither endless nor on a port that is in use
        words += ["--duration", "0.1", "--port", "0", "--no-browser"]
    assert main(*words) == 0, capsys.readouterr()


def test_all_commands_have_examples():
    examples = make_parser().format_help().split("examples:\n")[1].strip().splitlines()
    assert {example.strip() for example in examples} < set(example_commands())
    actions = make_parser()._subparsers._group_actions  # type: ignore[union-attr]
    assert set(actions[0].choices) == set(COMMANDS)
