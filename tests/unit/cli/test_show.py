"""`flatland show`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import pytest
from flatland_command import main

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


OPTIONS: list[tuple[list[str], dict[str, Any]]] = [
    (["--steps", "200"], {"steps": 200}),
    (["--size", "400x300"], {"size": (400, 300)}),
    (["--dpi", "60"], {"dpi": 60}),
    (["--view", "-1", "2", "5", "6"], {"view": (-1, 2, 5, 6)}),
    (["--layer", "empty"], {"layers": ["empty"]}),
    (["--names"], {"names": True}),
    (["--no-scans"], {"scans": False}),
    (["--no-axes"], {"axes": False}),
    (["--param", "/radius=1.5"], {"params": {"/radius": 1.5}}),
]


def test_options(world_file, tmp_path, capsys):
    path = tmp_path / "picture.png"
    small = ["show", world_file, "-o", path, "--dpi", "40"]
    default = drawn(world_file, dpi=40)
    for arguments, options in OPTIONS:
        assert main(*small, *arguments) == 0
        assert is_picture(path, drawn(world_file, **{"dpi": 40, **options})), arguments
        assert not is_picture(path, default), arguments
    assert main(*small, "--layer", "empty", "--layer", "3d") == 0
    assert is_picture(path, drawn(world_file, dpi=40, layers=["3d"]))
    assert capsys.readouterr() == ("", "")


def test_draws_a_model(files, tmp_path):
    body = "{name: base, footprints: [{type: circle, radius: 0.2, density: 1, layers: [any]}]}"
    path = files.write("robot.model.yaml", f"bodies: [{body}]")
    picture = tmp_path / "picture.png"
    assert main("show", path, "-o", picture) == 0
    with flatland.World(seed=0) as world:
        any_layer = path.replace("robot", "all")
        Path(any_layer).write_text(f"bodies: [{body.replace('[any]', '[all]')}]")
        world.spawn_model(any_layer, "robot")
        assert is_picture(picture, world.draw())


def test_a_line_says_that_transparent_walls_are_drawn(files, tmp_path, capsys):
    files.write_map("room", ["...", ".#.", "..."])
    layers = ", ".join(
        f"{{name: {name}, map: {file}, color: [1, 1, 1, {alpha}]}}"
        for name, file, alpha in (("a", "room.yaml", 0), ("b", "room.yaml", 1), ("c", "''", 0))
    )
    path = files.write("w.yaml", f"{{properties: {{}}, layers: [{layers}]}}")
    for arguments, line in (
        ((), 'layer "a" is drawn faintly, because the alpha of its color is 0\n'),
        (("--layer", "b"), ""),
    ):
        assert main("show", path, "-o", tmp_path / "a.png", *arguments) == 0
        assert capsys.readouterr().out == line


def test_lines_say_what_a_picture_does_not_show(files, tmp_path, capsys):
    def lines(bodies: str, *arguments: str, layers: str = "[]") -> list[str]:
        files.write("m.model.yaml", f"bodies: [{bodies}]")
        models = "models: [{name: m, model: m.model.yaml}]"
        path = files.write("w.yaml", f"properties: {{}}\nlayers: {layers}\n{models}\n")
        options = ["-o", tmp_path / "a.png", "--dpi", "20", "--no-axes", *arguments]
        assert main("show", path, *options) == 0
        return capsys.readouterr().out.splitlines()

    circle = "footprints: [{type: circle, radius: 1, density: 1}]"
    clear = f"color: [1, 0, 0, 0], {circle}"
    not_drawn = "not drawn, because the alpha of the color is 0: "
    assert lines(f"{{name: a, {circle}}}") == []
    assert lines(f"{{name: a, {circle}}}, {{name: b, {clear}}}") == [
        f'{not_drawn}body "b" of model "m"'
    ]
    assert lines(", ".join(f"{{name: {name}, {clear}}}" for name in "abcde")) == [
        f'{not_drawn}body "a" of model "m", body "b" of model "m", body "c" of model "m" '
        "and 2 others",
        "the picture is empty",
    ]
    assert lines("{name: a, footprints: []}") == [
        "the picture is empty, because the world has neither walls nor footprints"
    ]
    outside = "the picture is empty, because everything is outside of the view: walls and models "
    view = ("--view", "2", "2", "9", "9")
    assert lines(f"{{name: a, {circle}}}", *view) == [f"{outside}extend from (-1, -1) to (1, 1)"]
    files.write_map("room", ["#####", *["#...#"] * 3, "#####"])
    assert lines(f"{{name: a, {circle}}}", *view, layers="[{name: w, map: room.yaml}]") == []


def test_seed_makes_noise_repeatable(world_file, tmp_path):
    model = tmp_path / "robot.model.yaml"
    laser = "range: 9, always_publish: true, noise_std_dev: 0.05"
    model.write_text(model.read_text().replace("range: 9", laser))
    paths = [tmp_path / name for name in ("a.png", "b.png", "c.png")]
    for path, seed in zip(paths, "112", strict=True):
        assert main("show", world_file, "-o", path, "--steps", "3", "--seed", seed) == 0
    a, b, c = (path.read_bytes() for path in paths)
    assert a == b != c


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
    with pytest.raises(SystemExit, match="2"):
        main("show", world_file, *arguments)
    assert message in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()


def test_invalid_files_exit_with_1_and_one_line_of_error(world_file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main("show", "wordl.yaml", "-o", "a.png") == 1
    path = tmp_path / "wordl.yaml"
    hint = '(hint: did you mean "world.yaml"?)'
    expected = f'flatland: Flatland YAML: File does not exist, path="{path}" {hint}\n'
    assert capsys.readouterr() == ("", expected)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no/a.png"], "cannot write no/a.png: there is no folder no\n"),
        (["a.png", "--layer", "roof"], 'Flatland World: layer with name "roof" does not exist'),
    ],
)
def test_what_cannot_be_drawn_is_an_error(
    world_file, capsys, monkeypatch, tmp_path, arguments, message
):
    monkeypatch.chdir(tmp_path)
    assert main("show", world_file, "-o", *arguments) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"flatland: {message}")
    assert error.count("\n") == 1
