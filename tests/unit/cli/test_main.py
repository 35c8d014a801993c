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
from flatland_command import main, run
from programs import run_program

import flatland
from flatland.cli import arguments
from flatland.cli.main import make_parser


@pytest.mark.parametrize(
    ("file", "stderr"), [("world.yaml", subprocess.PIPE), ("nowhere.yaml", subprocess.STDOUT)]
)
def test_output_or_errors_without_a_reader(world_file, tmp_path, file, stderr):
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run("check", file, stdout=writing, cwd=tmp_path, stderr=stderr)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


def test_version_equals_that_of_the_packages(checkout, capsys):
    project = tomllib.loads((checkout / "pyproject.toml").read_text())["project"]
    package = ElementTree.parse(checkout / "catkin" / "flatland" / "package.xml").getroot()
    assert flatland.__version__ == package.findtext("version")
    assert project["dynamic"] == ["version"]  # of flatland/version.py
    assert project["scripts"]["flatland"] == "flatland.cli:main"
    with pytest.raises(SystemExit) as caught:
        main("--version")
    assert (caught.value.code, capsys.readouterr().out) == (0, f"flatland {flatland.__version__}\n")


def test_a_command_is_required(capsys):
    with pytest.raises(SystemExit, match="2"):
        main()
    assert "COMMAND" in capsys.readouterr().err


def test_values_of_parameters_are_yaml():
    values = {"1": 1, "0.5": 0.5, "true": True, "a b": "a b", "": "", "a=b": "a=b"}
    for text, value in values.items():
        assert arguments.parameter(f"/x={text}") == ("/x", value)


def test_completion(tmp_path):
    """Answers the shell as argcomplete requires: the words are written to file descriptor 8."""
    shell = {"": "1", "_IFS": "\n", "_SHELL": "bash"}
    words = {"COMP_LINE": "flatland d", "COMP_POINT": "10", "COMP_TYPE": "9"}
    done = run_program(
        ["bash", "-c", f'"{sys.executable}" -m flatland 8>&1 9>/dev/null >/dev/null'],
        env=os.environ | {f"_ARGCOMPLETE{name}": value for name, value in shell.items()} | words,
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
