"""`flatland show`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import pytest
from flatland_command import main, run

import flatland


def drawn(world_file: str, *, steps: int = 0, **options: Any) -> Any:
    """Returns the expected picture of `flatland show`."""
    load = {key: options.pop(key) for key in ("params", "simplify_map") if key in options}
    with flatland.World.from_yaml(world_file, seed=1, **load) as world:
        world.step(steps)
        return world.draw(**options)


def is_picture(path: Path, expected: Any) -> bool:
    pixels = cv2.imread(str(path))[:, :, ::-1]
    return pixels.shape == expected.shape and bool((pixels == expected).all())


def test_draws_the_world(world_file, tmp_path):
    path = tmp_path / "picture.png"
    done = run("show", world_file, "-o", path, cwd=tmp_path.parent)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert done.stderr == ""
    assert is_picture(path, drawn(world_file))


@pytest.mark.parametrize(
    ("arguments", "options"),
    [
        (["--steps", "200"], {"steps": 200}),
        (["--size", "400x300"], {"size": (400, 300)}),
        (["--dpi", "50"], {"dpi": 50}),
        (["--view", "-1", "2", "5", "6"], {"view": (-1, 2, 5, 6)}),
        (["--layer", "empty"], {"layers": ["empty"]}),
        (["--layer", "empty", "--layer", "3d"], {"layers": ["3d"]}),
        (["--names"], {"names": True}),
        (["--no-scans"], {"scans": False}),
        (["--no-axes"], {"axes": False}),
        (["--param", "/radius=1.5"], {"params": {"/radius": 1.5}}),
    ],
)
def test_options(world_file, tmp_path, arguments, options):
    path = tmp_path / "picture.png"
    assert main("show", world_file, "-o", path, *arguments) == 0
    assert is_picture(path, drawn(world_file, **options))
    if arguments[-1] != "3d":
        assert not is_picture(path, drawn(world_file))


def test_seed_makes_noise_repeatable(world_file, tmp_path):
    model = tmp_path / "robot.model.yaml"
    laser = "range: 9, always_publish: true, noise_std_dev: 0.05"
    model.write_text(model.read_text().replace("range: 9", laser))
    paths = [tmp_path / name for name in ("a.png", "b.png", "c.png")]
    for path, seed in zip(paths, "112", strict=True):
        assert main("show", world_file, "-o", path, "--steps", "3", "--seed", seed) == 0
    a, b, c = (path.read_bytes() for path in paths)
    assert a == b != c


def test_an_existing_picture_is_overwritten(world_file, tmp_path):
    path = tmp_path / "picture.png"
    path.write_text("old")
    assert main("show", world_file, "-o", path) == 0
    assert is_picture(path, drawn(world_file))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "-o/--output"),
        (["-o", "a.gif"], "must end with one of .png, .pdf, .svg, got 'a.gif'"),
        (["-o", "a.png", "--size", "12"], "must be WIDTHxHEIGHT"),
        (["-o", "a.png", "--size", "20x20"], "too small for the axes"),
        (["-o", "a.png", "--steps", "-1"], "must be an integer of at least 0"),
        (["-o", "a.png", "--param", "radius"], "must be NAME=VALUE"),
        (["-o", "a.png", "--param", "/radius=[1"], "the value is not YAML"),
        (["-o", "a.png", "--view", "1", "0", "0", "1"], "x_min < x_max"),
        (["-o", "a.png", "--simplify-map", "3"], "invalid choice"),
    ],
)
def test_invalid_arguments_exit_with_2(
    world_file, capsys, monkeypatch, tmp_path, arguments, message
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as caught:
        main("show", world_file, *arguments)
    assert caught.value.code == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()


def test_invalid_files_exit_with_1_and_one_line_of_error(world_file, tmp_path):
    done = run("show", "nowhere.yaml", "-o", "a.png", cwd=tmp_path)
    assert done.returncode == 1
    path = tmp_path / "nowhere.yaml"
    hint = '(hint: did you mean "world.yaml"?)'
    expected = f'flatland: Flatland YAML: File does not exist, path="{path}" {hint}\n'
    assert done.stderr == expected


def test_a_picture_that_cannot_be_written_is_an_error(world_file, tmp_path, capsys):
    assert main("show", world_file, "-o", tmp_path / "no" / "a.png") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("flatland: ")
    assert "No such file or directory" in line


def test_an_unknown_layer_is_an_error(world_file, tmp_path, capsys):
    assert main("show", world_file, "-o", tmp_path / "a.png", "--layer", "roof") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line == 'flatland: Flatland World: layer with name "roof" does not exist'
