"""The included suites, and the page that describes scenarios."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from pages import code_blocks

from flatland.cli.main import make_parser
from flatland.config.collecting_reader import ErrorCollector
from flatland.scenarios.columns import COLUMNS
from flatland.scenarios.controllers import INCLUDED
from flatland.scenarios.episode import Options, run_scenario
from flatland.scenarios.reader import read_scenarios
from flatland.scenarios.scenario import Run
from flatland.scenarios.suite import SUITES, SuiteError, included_suites, load_suite, scenario_files

NAMES = ("crossing_people", "fleet", "maze", "narrow_doors", "office", "warehouse")


def test_the_included_suites_have_no_errors():
    assert included_suites() == sorted(NAMES)
    collector = ErrorCollector()
    scenarios = load_suite(scenario_files(NAMES), read=collector.read)
    assert collector.errors == []
    assert len({one.title for one in scenarios}) == len(scenarios) >= 60
    assert all(one.description for one in scenarios)


@pytest.mark.parametrize("name", NAMES)
def test_each_scenario_of_a_suite_fits_its_world(name, tmp_path):
    for scenario in read_scenarios(SUITES / f"{name}.yaml"):
        short = replace(scenario, limits=replace(scenario.limits, time=0.3))
        run = Run(short, "straight", scenario.seeds[0])
        row = run_scenario(run, Options("", str(tmp_path), "none")).row
        assert row["error"] is None, (scenario.title, row["error"])


def test_scenario_files_of_folders_and_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "b.yaml").write_text("{world: w.yaml, goal: [1, 1]}")
    (folder / "world.yaml").write_text("{properties: {}, layers: []}")
    assert scenario_files(["mine", "maze"]) == [Path("mine/b.yaml"), SUITES / "maze.yaml"]
    with pytest.raises(SuiteError) as caught:
        scenario_files(["offices"])
    assert caught.value.hint == 'did you mean "office"?'
    (folder / "b.yaml").unlink()
    with pytest.raises(SuiteError, match="contains no scenario file"):
        scenario_files(["mine"])


def test_only_some_scenarios():
    files = scenario_files(["narrow_doors"])
    titles = [one.title for one in load_suite(files, pattern="*two_doors*")]
    assert titles == ["narrow_doors/two_doors[door=1.0]", "narrow_doors/two_doors[door=0.8]"]
    with pytest.raises(SuiteError, match="no scenario has a title"):
        load_suite(files, pattern="ghost")


# -- the page ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def page(checkout):
    return (checkout / "docs" / "scenarios.md").read_text()


def test_the_page_describes_all_columns(page):
    table = page.split("## Measures", 1)[1].split("\n## ", 1)[0]
    rows = [line.split("|") for line in table.splitlines() if line.startswith("| `")]
    described = {}
    for _, names, unit, *_ in rows:
        described |= dict.fromkeys(re.findall("`([a-z_]+)`", names), unit.strip())
    assert described == {name: column.unit for name, column in COLUMNS.items()}
    timing = [name for name, column in COLUMNS.items() if column.is_timing]
    assert len(timing) == 6
    assert list(described)[-6:] == timing


def test_the_page_describes_all_controllers_and_options(page):
    assert [name for name in INCLUDED if f"| `{name}` |" not in page] == []
    assert [name for name in NAMES if f"| `{name}` |" not in page] == []
    actions = make_parser()._subparsers._group_actions  # type: ignore[union-attr]
    options = {
        option
        for action in actions[0].choices["test"]._actions
        for option in action.option_strings
        if option.startswith("--")
    }
    assert [
        one
        for one in sorted(options - {"--help"})
        if f"`{one}" not in page and f" {one}" not in page
    ] == []


def test_the_scenarios_of_the_page_run(page, tmp_path):
    blocks = code_blocks(page, "yaml")
    for name, text in re.findall(r"File `([^`]+)`:\n\n```yaml\n(.*?)```", page, re.DOTALL):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    named = [block for block in blocks if block.startswith("# scenarios/")]
    assert len(named) == 2
    program, policy = code_blocks(page, "python")
    compile(policy, "learned.py", "exec")
    (tmp_path / "careful.py").write_text(program)
    for block in named:
        path = tmp_path / block.partition("\n")[0].removeprefix("# ")
        path.write_text(block)
        for scenario in read_scenarios(path)[:2]:
            short = replace(scenario, limits=replace(scenario.limits, time=3.0))
            for controller in ("gap", "careful.py:Careful"):
                options = Options(str(tmp_path), str(tmp_path / "out"), "none")
                row = run_scenario(Run(short, controller, scenario.seeds[0]), options).row
                assert row["error"] is None


def test_the_workflows_of_the_page_are_valid(page):
    texts = [b for b in code_blocks(page, "yaml") if b.startswith("# .github/workflows/")]
    assert len(texts) == 2
    for text in texts:
        steps = yaml.safe_load(text)["jobs"]["scenarios"]["steps"]
        lines = [line for step in steps for line in step.get("run", "").splitlines()]
        (command,) = [line for line in lines if line.startswith("flatland test")]
        options = make_parser().parse_args(command.split()[1:])
        assert options.baseline == Path("baseline.json")
        assert scenario_files(options.paths)
        for step in steps:
            subprocess.run(["bash", "-n", "-c", step.get("run", "")], check=True)


def test_the_packages_of_the_workflow_are_a_list_of_names(page, checkout):
    """The workflow passes the file to apt-get by this command."""
    assert "sed 's/#.*//' packages.txt" in page
    file = checkout / "examples" / "navigation" / "packages-apt.txt"
    output = subprocess.run(["sed", "s/#.*//", file], check=True, capture_output=True, text=True)
    names = output.stdout.split()
    assert len(names) == len(set(names)) > 20
    assert all(re.fullmatch(r"[a-z0-9][a-z0-9+.-]+", name) for name in names)
    # What a stack needs at run time is what flatland's own node needs.
    own = {
        line.split()[1]
        for line in (checkout / "packages-apt.txt").read_text().splitlines()
        if re.match(r"(run|dev) ", line)
    }
    later = output.stdout.partition("python3-venv")[2].split()
    assert set(later) <= own
