"""Files and parameters that are read through one object."""

from __future__ import annotations

from pathlib import Path

import pytest

from flatland.config.inputs import Inputs
from flatland.config.reader import YamlReader, read_yaml


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "part.yaml").write_text("b: $eval param('/size')\n")
    path = tmp_path / "file.yaml"
    path.write_text("a: $include part.yaml\na: again\n")
    return path


def test_everything_that_is_read_is_listed(file: Path) -> None:
    inputs = Inputs({"/size": 3})
    read_yaml(str(file), inputs)
    assert list(inputs.files) == [str(file), str(file.parent / "part.yaml")]
    assert inputs.params == {"/size": 3}
    assert inputs.expression_count == 1


def test_a_read_elsewhere_is_not_affected(file: Path) -> None:
    inputs = Inputs({"/size": 3}, folders=(str(file.parent / "other"),))
    with inputs.loading():
        read_yaml(str(file), inputs)
        other = file.with_name("third.yaml")
        other.write_text("a: 1\n")
        assert YamlReader.from_file(other).get("a", "int") == 1
        other.write_text("a: 2\n")
        assert YamlReader.from_file(other).get("a", "int") == 2
    assert str(other) not in inputs.files


def test_loading_reads_each_file_once_and_in_all_folders(file: Path) -> None:
    params = {"/size": 3}
    inputs = Inputs(params, folders=(str(file.parent / "other"),))
    with inputs.loading():
        first = read_yaml(str(file), inputs).plain()
    file.unlink()
    (file.parent / "part.yaml").unlink()
    params["/size"] = 4
    with inputs.loading():
        assert read_yaml(str(file), inputs).plain() == first
        assert inputs.exists(str(file))
    with pytest.raises(PermissionError, match="outside the folders of model_path"):
        inputs.exists(str(file))


@pytest.mark.skipif(not Path("/proc/version").exists(), reason="there is no /proc")
def test_files_of_the_kernel_are_refused() -> None:
    with pytest.raises(OSError, match="it is a virtual file of the kernel"):
        Inputs().read("/proc/version")


@pytest.mark.parametrize("logs", [False, True])
def test_warnings_can_be_left_out(file: Path, logs: bool, caplog: pytest.LogCaptureFixture) -> None:
    read_yaml(str(file), Inputs(logs=logs))
    texts = [record.getMessage() for record in caplog.records]
    assert texts == logs * [
        f'Duplicate key "a" ignored, the value in line 1 is used [{file}:2]',
        f'param "/size" is not set [{file.parent}/part.yaml:1]',
    ]


def test_a_saved_state_repeats_random_numbers(tmp_path: Path) -> None:
    path = tmp_path / "random.yaml"
    path.write_text("$eval math.random()\n")
    inputs = Inputs()
    inputs.set_seed(7)
    state = inputs.save()
    first = read_yaml(str(path), inputs).value("float")
    second = read_yaml(str(path), inputs).value("float")
    assert first != second
    inputs.restore(state)
    assert not inputs.files
    assert read_yaml(str(path), inputs).value("float") == first
    copy = inputs.copy()
    assert read_yaml(str(path), copy).value("float") == second
    assert read_yaml(str(path), inputs).value("float") == second
