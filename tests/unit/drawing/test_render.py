"""Images of worlds: position and colour of every part, sizes, files, and threads."""

from __future__ import annotations

import sys
import threading
from typing import Any

import cv2
import numpy as np
import pytest
from full_disk import REASON, limited_files
from matplotlib.text import Text
from programs import run_program

import flatland
from flatland import drawing
from flatland.drawing import render
from flatland.scene.world_scene import describe_world

ROOM = ["##########", *["#........#"] * 8, "##########"]  # 1 m cells: walls at x, y = 1 and 9
FLOOR = (251, 251, 249)
RED, BLUE = (255, 0, 0), (0, 0, 255)
SCAN = (224, 57, 43)  # colour of the first laser
SCALE = 50  # pixels per metre in the images of `plan`


def room_world(files: Any, model: str = "", color: str = "[1, 0, 0, 1]", **options: Any) -> Any:
    """A room with red walls, and a model at (4, 3) that heads along the y axis."""
    files.write_map("room", ROOM)
    files.write("robot.model.yaml", model or "bodies: [{name: empty, footprints: []}]")
    return files.load(
        f"""
        properties: {{}}
        layers: [{{name: walls, map: room.yaml, color: {color}}}]
        models: [{{name: robot, model: robot.model.yaml, pose: [4, 3, 1.5707963267948966]}}]
        """,
        **options,
    )


def body(extra: str = "", footprint: str = "type: circle, radius: 0.8") -> str:
    """A model with one opaque blue body."""
    footprint = f"{{{footprint}, density: 1{extra}}}"
    return f"bodies: [{{name: base, color: [0, 0, 1, 1], footprints: [{footprint}]}}]"


def laser(extra: str = "", increment: float = 0.02) -> str:
    fan = f"{{min: -3.14, max: 3.14, increment: {increment}}}"
    return f"\nplugins: [{{type: Laser, name: eye, body: base, range: 20, angle: {fan}{extra}}}]"


def plan(world: flatland.World, **options: Any) -> Any:
    """Draws 10 m x 10 m without axes, with 50 pixels per metre."""
    pixels = world.draw(size=(10 * SCALE, 10 * SCALE), view=(0, 0, 10, 10), axes=False, **options)
    assert pixels.shape == (500, 500, 3)
    return pixels


def at(pixels: Any, x: float, y: float) -> Any:
    """Returns the pixel of a plan at a point in the world frame [m]."""
    return pixels[round((10 - y) * SCALE - 0.5), round(x * SCALE - 0.5)]


def is_like(pixels: Any, color: Any, tolerance: float = 12) -> Any:
    return np.abs(pixels.astype(int) - color).max(axis=-1) <= tolerance


def points_like(pixels: Any, color: Any, tolerance: float = 12) -> Any:
    """Returns the positions of pixels of a colour in a plan, world frame [m], shape (n, 2)."""
    rows, columns = np.nonzero(is_like(pixels, color, tolerance))
    return np.stack([(columns + 0.5) / SCALE, 10 - (rows + 0.5) / SCALE], axis=1)


def distance_from_walls(points: Any) -> Any:
    return np.abs(np.abs(points - 5).max(axis=1) - 4)


class TestWalls:
    def test_walls_have_the_positions_of_the_map(self, files):
        pixels = plan(room_world(files))
        red = points_like(pixels, RED, 60)
        inside = red[np.abs(red - 5).max(axis=1) < 4.9]  # without the outer boundary of the map
        assert distance_from_walls(inside).max() < 1.5 / SCALE
        for along in np.arange(1.05, 8.95, 0.3):
            for point in [(along, 1), (along, 9), (1, along), (9, along)]:
                assert np.hypot(*(inside - point).T).min() < 1.5 / SCALE
        assert tuple(at(pixels, 6, 6)) == FLOOR
        assert tuple(at(pixels, 0.5, 5)) == FLOOR

    def test_bright_colours_are_darkened(self, files):
        for color, shown in [("[1, 1, 1, 1]", 127), ("[0.2, 0.2, 0.2, 1]", 51)]:
            assert len(points_like(plan(room_world(files, color=color)), (shown,) * 3, 3)) > 500

    def test_only_selected_layers_are_drawn(self, files):
        world = room_world(files)
        assert (plan(world, layers=[]) == FLOOR).all()
        assert (plan(world, layers=["walls"]) == plan(world)).all()

    def test_edges_of_a_layer_are_one_collection(self, files):
        """One artist per edge would take half a minute for a large map."""
        np.savetxt(files.folder / "map.dat", np.random.default_rng(0).uniform(0, 9, (1000, 4)))
        files.write("map.yaml", "{type: line_segments, data: map.dat, scale: 1, origin: [0, 0, 0]}")
        world = files.load("{properties: {}, layers: [{name: walls, map: map.yaml}]}")
        (axes,) = drawing.make_figure(world).axes
        assert 1000 in [len(part.get_paths()) for part in axes.collections]
        assert len(axes.get_children()) < 30


class TestModels:
    def test_footprint_has_the_pose_of_its_body(self, files):
        world = room_world(files, body())
        filled = tuple(
            round(0.4 * floor + 0.6 * blue) for floor, blue in zip(FLOOR, BLUE, strict=True)
        )
        for x, y in [(4, 3), (7, 6.5)]:
            world.move_model("robot", (x, y, 1.0))
            blue = points_like(plan(world), filled)
            assert blue.mean(axis=0) == pytest.approx((x, y), abs=0.05)
            assert 0.7 < np.hypot(*(blue - (x, y)).T).max() < 0.82
            assert len(blue) > 0.7 * np.pi * (0.8 * SCALE) ** 2

    def test_footprint_has_an_outline(self, files):
        pixels = plan(room_world(files, body()))
        outline = points_like(pixels, (0, 0, 140), 40)
        distances = np.hypot(*(outline - (4, 3)).T)
        # The heading triangle in the centre has the same colour.
        assert distances[distances > 0.4].min() > 0.77
        assert (distances > 0.4).sum() > 0.7 * 2 * np.pi * 0.8 * SCALE

    @pytest.mark.parametrize("heading", [2.0, -1.0])
    def test_triangle_shows_the_heading(self, files, heading):
        world = room_world(files, body())
        world.move_model("robot", (5, 5, heading))
        marks = points_like(plan(world), (0, 0, 140), 40) - (5, 5)
        marks = marks[np.hypot(*marks.T) < 0.6]
        ahead = marks @ (np.cos(heading), np.sin(heading))
        aside = marks @ (-np.sin(heading), np.cos(heading))
        # Wide at the back, with the tip at 60 % of the length in front of the centre.
        assert ahead.max() == pytest.approx(0.6 * 0.4 * 1.6, abs=0.06)
        assert ahead.min() == pytest.approx(-0.4 * 0.4 * 1.6, abs=0.04)
        assert np.ptp(aside[ahead < -0.1]) > 3 * np.ptp(aside[ahead > 0.25])
        # Longer than wide, so that the tip is unambiguous.
        assert np.ptp(aside) < 0.8 * np.ptp(ahead)

    def test_footprints_are_translucent(self, files):
        world = room_world(files, body())
        world.move_model("robot", (5, 9, 0.0))
        # Beside the heading triangle.
        assert (points_like(plan(world)[:, 220:235], (102, 0, 153), 30)).size

    def test_sensors_are_not_filled(self, files):
        pixels = plan(room_world(files, body(", sensor: true")))
        assert tuple(at(pixels, 4.5, 3)) == FLOOR
        assert len(points_like(pixels, (0, 0, 140), 40)) > 100

    def test_tiny_model_is_drawn_as_a_dot_of_its_colour(self, files):
        world = room_world(files, body(footprint="type: circle, radius: 0.001"))
        dot = points_like(plan(world), (0, 0, 255), 40)
        assert dot.mean(axis=0) == pytest.approx((4, 3), abs=0.05)
        assert 0.05 < np.ptp(dot[:, 0]) < 0.13, "8 pixels with the outline"
        marks = points_like(plan(world), (0, 0, 140), 60)
        assert marks[:, 1].max() > dot[:, 1].max() + 0.04, "a line in the direction of its heading"

    def test_walls_of_alpha_0_are_drawn_faintly(self, files):
        faint, clear = (
            plan(room_world(files, color=f"[0, 0, 1, {alpha}]")) for alpha in ("0", "1")
        )
        is_wall = is_like(clear, BLUE)
        assert not is_like(faint, FLOOR)[is_wall].any()
        assert faint[is_wall].mean() > clear[is_wall].mean() + 60

    def test_joints_have_their_own_colour(self, files):
        model = """
        bodies: [{name: a, footprints: []}, {name: b, pose: [3, 0, 0], footprints: []}]
        joints:
        - type: weld
          name: j
          color: [0, 0.5, 0, 1]
          bodies: [{name: a, anchor: [1, 0]}, {name: b, anchor: [-2, 0]}]
        """
        green = points_like(plan(room_world(files, model)), (0, 128, 0), 80)
        assert green.min(axis=0) == pytest.approx((4, 3), abs=0.07)
        assert green.max(axis=0) == pytest.approx((4, 6), abs=0.07)

    def test_names_are_above_the_models(self, files):
        world = room_world(files, body())
        named = plan(world, names=True)
        rows, columns = np.nonzero((named != plan(world)).any(axis=2))
        assert columns.mean() / SCALE == pytest.approx(4, abs=0.1)
        assert 3.8 < 10 - rows.max() / SCALE < 10 - rows.min() / SCALE < 4.3

    def test_name_is_not_parsed_as_a_formula(self, files):
        files.write("robot.model.yaml", body())
        world = files.load(r"""{properties: {}, layers: [],
            models: [{name: '$\x$', model: robot.model.yaml}]}""")
        figure = drawing.make_figure(world, names=True)
        # matplotlib draws a formula with fonts of its own, and fails for one it cannot parse.
        (name,) = [text for text in figure.findobj(Text) if text.get_text() == r"$\x$"]
        assert not name.get_parse_math()
        unnamed, named = world.draw(), world.draw(names=True)
        assert (named != unnamed).any()


class TestScans:
    def test_hits_are_on_the_walls(self, files):
        pixels = plan(room_world(files, body() + laser(), color="[0, 0.3, 0.3, 1]"))
        scan = points_like(pixels, SCAN, 30)
        assert len(scan) > 300
        assert distance_from_walls(scan).max() < 3 / SCALE
        # Hits on all four walls.
        assert scan.min(axis=0) == pytest.approx((1, 1), abs=0.1)
        assert scan.max(axis=0) == pytest.approx((9, 9), abs=0.1)
        # The scanned area is tinted.
        assert tuple(at(pixels, 6, 6)) != FLOOR
        assert tuple(at(pixels, 0.5, 6)) == FLOOR

    def test_scans_are_optional(self, files):
        with_laser = room_world(files, body() + laser())
        without = room_world(files, body())
        assert (plan(with_laser, scans=False) == plan(without)).all()


def test_drawing_does_not_modify_the_simulation(files):
    drive = "{type: DiffDrive, name: d, body: base}"
    model = body() + laser(", noise_std_dev: 0.1").replace("plugins: [", f"plugins: [{drive}, ")
    seen: list[list[bytes]] = []
    for drawn in (False, True):
        world = room_world(files, model, seed=7)
        world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0, angular_z=0.7))
        if drawn:
            world.draw()
        scan, scans = world.output("/scan"), []
        for _ in range(4):
            world.step(20)
            if drawn:
                world.draw(dpi=30)
            scans.append(scan.latest.ranges.tobytes() + repr(world.models[0].pose).encode())
        seen.append(scans)
    assert seen[0] == seen[1]
    assert len(set(seen[0])) == 4, "robot does not move, or scans have no noise"


def test_drawing_does_not_subscribe_to_outputs(files):
    world = room_world(files, body() + laser())
    world.draw()
    assert not world.ports.find_output("/scan").wanted


@pytest.mark.threads
class TestThreads:
    def test_running_world_can_be_drawn_from_other_threads(self, files, monkeypatch):
        world = room_world(files, body() + laser())
        world.output("/scan")
        inside_a_step: list[bool] = []

        def describe(*arguments: Any) -> Any:
            inside_a_step.append(world.requests.in_hook)
            return describe_world(*arguments)

        monkeypatch.setattr(render, "describe_world", describe)
        images: list[Any] = []
        failures: list[BaseException] = []

        def run() -> None:
            try:
                images.extend(plan(world) for _ in range(2))
            except BaseException as error:
                failures.append(error)

        threads = [threading.Thread(target=run) for _ in range(2)]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            world.step(10)
        assert not failures
        assert len(images) == 4
        assert inside_a_step == [False] * 4
        # The robot is at rest, and its laser has no noise.
        assert all((image == images[0]).all() for image in images)

    def test_hook_can_draw(self, files):
        world = room_world(files, body() + laser())
        images: list[Any] = []
        world.output("/scan").subscribe(lambda scan: images.append(plan(world)))
        world.step()
        assert len(points_like(images[0], SCAN, 30)) > 300


class TestImage:
    def test_same_world_gives_the_same_image(self, files):
        world = room_world(files, body() + laser())
        image = flatland.draw(world, names=True)
        assert image.dtype == np.uint8
        assert image.flags.c_contiguous
        assert (image == world.draw(names=True)).all()

    @pytest.mark.parametrize("size", [(29, 57), (333, 1001)])
    def test_size_is_exact(self, files, size):
        world = room_world(files)
        assert world.draw(size=size, axes=False).shape == (size[1], size[0], 3)
        assert world.draw(size=size, dpi=20).shape == (size[1], size[0], 3)

    def test_default_size_depends_on_the_view(self, files):
        world = room_world(files)
        assert world.draw(axes=False).shape == (900, 900, 3)
        assert world.draw(axes=False, view=(0, 0, 130, 10)).shape == (200, 1300, 3)
        once, half = world.draw(), world.draw(dpi=50)
        assert np.array(half.shape[:2]) == pytest.approx(np.array(once.shape[:2]) / 2, abs=1)

    def test_scale_is_the_same_along_both_axes(self, files):
        figure = drawing.make_figure(room_world(files), size=(800, 500))
        to_pixels = figure.axes[0].transData.transform
        (x0, y0), (x1, _), (_, y2) = to_pixels([(0, 0), (1, 0), (0, 1)])
        assert x1 - x0 == pytest.approx(y2 - y0, rel=1e-3)
        # The whole map is visible.
        (left, bottom), (right, top) = to_pixels([(0, 0), (10, 10)])
        assert 0 < left < right < 800
        assert 0 < bottom < top < 500
        # The walls match the axes.
        red = np.argwhere(is_like(room_world(files).draw(size=(800, 500)), RED, 60))
        assert red[:, 1].min() == pytest.approx(left, abs=2)
        assert red[:, 0].max() == pytest.approx(500 - bottom, abs=2)

    def test_axes_are_in_metres(self, files):
        (axes,) = drawing.make_figure(room_world(files)).axes
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
        assert "4" in [label.get_text() for label in axes.get_xticklabels()]

    @pytest.mark.parametrize(
        ("view", "size"),
        [
            ((0, 0, 10, 10), None),
            ((100, 200, 100.9, 200.9), (800, 500)),
            ((-101, -201, -100.5, -200.5), (300, 900)),
            ((0, -12_000, 9_000, 9_000), None),
            ((-1e9, -1e9, 1e9, 1e9), (300, 900)),
            ((0, -1, 50, 1), (800, 500)),
        ],
    )
    def test_axis_labels_are_not_clipped(self, empty_world, view, size):
        figure = drawing.make_figure(empty_world, view=view, size=size)
        figure.canvas.draw()
        labels = figure.axes[0].get_tightbbox(figure.canvas.get_renderer())
        width, height = figure.canvas.get_width_height()
        assert labels.x0 >= 0
        assert labels.y0 >= 0
        assert labels.x1 <= width
        assert labels.y1 <= height

    def test_empty_world(self, empty_world):
        assert (empty_world.draw(axes=False) == FLOOR).all()

    def test_robot_without_a_map_is_in_the_centre(self, files):
        files.write("robot.model.yaml", body())
        world = files.load("""{properties: {}, layers: [],
            models: [{name: robot, model: robot.model.yaml, pose: [100, 50, 0]}]}""")
        pixels = world.draw(axes=False)
        rows, columns = np.nonzero(~is_like(pixels, FLOOR))
        middle = (rows.mean() / pixels.shape[0], columns.mean() / pixels.shape[1])
        assert middle == pytest.approx((0.5, 0.5), abs=0.01)

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"size": (0, 100)}, "size must be whole numbers of pixels"),
            ({"size": (100.5, 100)}, "size must be whole numbers of pixels"),
            ({"size": (100_000, 100)}, "size must be whole numbers of pixels"),
            ({"size": 100}, r"size must be \(width, height\)"),
            ({"size": (60, 60)}, "too small for the axes"),
            ({"dpi": 0}, "dpi must be from 10"),
            ({"dpi": float("nan")}, "dpi must be from 10"),
            ({"view": (0, 0, 1)}, "view must be four numbers"),
            ({"view": (0, 0, 1, float("nan"))}, "view must be within"),
            ({"view": (1, 0, 0, 1)}, "x_min < x_max"),
            ({"view": (0, 0, 1, float("inf"))}, "view must be within"),
            ({"layers": "walls"}, "layers must be a list of names, got 'walls'"),
        ],
    )
    def test_invalid_options_raise(self, empty_world, options, message):
        with pytest.raises(ValueError, match=message):
            empty_world.draw(**options)


class TestSave:
    def test_png_equals_the_array(self, files, tmp_path):
        world = room_world(files, body() + laser())
        path = tmp_path / "image.PNG"
        path.write_text("something else")
        drawing.save(world, path, size=(400, 300))
        blue_green_red = cv2.imread(str(path))
        assert (blue_green_red[:, :, ::-1] == world.draw(size=(400, 300))).all()

    def test_vector_formats(self, files, tmp_path):
        drawing.save(room_world(files, body()), tmp_path / "a.svg")
        assert (tmp_path / "a.svg").read_bytes().startswith(b"<?xml")

    @pytest.mark.parametrize("name", ["a.png", "a.svg", "a.pdf"])
    def test_a_full_disk_leaves_no_picture(self, files, tmp_path, name):
        world = room_world(files, body())
        drawing.save(world, tmp_path / name)  # Modules and fonts are loaded.
        (tmp_path / name).write_text("old")
        before = set(tmp_path.iterdir())
        with limited_files(1000), pytest.raises(OSError, match=REASON) as caught:
            drawing.save(world, tmp_path / name)
        assert caught.value.filename == str(tmp_path / name)
        assert (tmp_path / name).read_text() == "old"
        assert set(tmp_path.iterdir()) == before

    def test_unknown_extension_raises(self, empty_world):
        with pytest.raises(ValueError, match=r"must end with one of .png, .pdf, .svg"):
            drawing.save(empty_world, "image.xcf")


def test_first_image_imports_matplotlib_without_pyplot(tmp_path):
    script = (
        "import sys, flatland\n"
        "NAMES = ('matplotlib', 'matplotlib.pyplot')\n"
        "def loaded(): print([name for name in NAMES if name in sys.modules])\n"
        "with flatland.World() as world:\n"
        "    world.step(); loaded()\n"
        "    world.draw(); flatland.drawing.save(world, 'a.pdf'); loaded()\n"
    )
    command = [sys.executable, "-W", "error", "-c", script]
    done = run_program(command, cwd=tmp_path, check=True)
    assert done.stdout.splitlines() == ["[]", "['matplotlib']"]
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
