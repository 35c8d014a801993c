"""Random worlds: everything free is reached, the same seed gives the same files, and they run."""

from __future__ import annotations

import hashlib
import inspect
import math
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from full_disk import REASON, limited_files
from programs import run_program

import flatland
from flatland import worldgen
from flatland.worldgen.raster import Rect
from flatland.worldgen.room import Room

# In metres; the first one has several corridors, and is used once.
SIZES = ((30.0, 23.0), *((14.0, 11.0), (12.0, 14.0), (16.0, 10.0)) * 3)
KINDS = worldgen.KINDS
SMALL = (18.0, 14.0)

Mask = npt.NDArray[np.bool_]


def regions(mask: Mask) -> int:
    """Returns the number of regions that are connected along the sides of cells."""
    count, _ = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    return int(count) - 1


def places(grid: Any, radius: float) -> Mask:
    """Returns the cells at whose centres a disc fits: the nearest obstacle is beyond its radius."""
    free = np.pad(grid.cells == 0, 1).astype(np.uint8)
    # To the centre of the nearest occupied cell, whose side is half a cell nearer.
    distances = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    mask: Mask = (distances - 0.5) * grid.resolution >= radius - 1e-6
    return mask


@pytest.mark.parametrize("kind", KINDS)
def test_a_disc_reaches_all_free_places_in_ten_worlds(kind: str) -> None:
    for seed, size in enumerate(SIZES):
        world = worldgen.generate(kind, seed, size)
        assert regions(world.grid.cells == 0) == 1, seed
        fits = places(world.grid, 0.3)
        assert regions(fits) == 1, seed
        x, y, _ = world.start
        assert fits[int(y / 0.05), int(x / 0.05)], seed
        assert 0.6 < (world.grid.cells == 0).mean() < 0.95, seed


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("radius", "resolution"), [(0.15, 0.03), (0.45, 0.1), (0.4, 0.05)])
def test_other_radii_and_resolutions(kind: str, radius: float, resolution: float) -> None:
    world = worldgen.generate(kind, 0, (18.0, 23.0), resolution=resolution, radius=radius)
    fits = places(world.grid, radius)
    assert regions(fits) == 1
    assert fits.mean() > 0.15
    # The world is higher than wide.
    assert world.size == pytest.approx((18, 23), abs=resolution)
    assert world.size == pytest.approx(np.flip(fits.shape) * resolution)


@pytest.mark.parametrize("kind", KINDS)
def test_there_are_no_narrow_gaps(kind: str) -> None:
    for seed in range(3):
        free = np.pad(worldgen.generate(kind, seed, SMALL).grid.cells == 0, 6)
        # Each free cell is part of a free square of 0.3 m.
        squares = np.lib.stride_tricks.sliding_window_view(free, (6, 6)).all(axis=(2, 3))
        covered = np.zeros_like(free)
        for row, column in np.ndindex(6, 6):
            covered[row : row + len(squares), column : column + squares.shape[1]] |= squares
        assert (covered == free).all()


def test_doors_are_from_90_to_120_cm_wide(monkeypatch: pytest.MonkeyPatch) -> None:
    widths = []
    add_door = Room.add_door

    def record(room: Room, opening: Rect) -> None:
        if room.kind != "lounge":  # open along the whole side
            widths.append(max(opening.width, opening.height))
        add_door(room, opening)

    monkeypatch.setattr(Room, "add_door", record)
    for seed in range(5):
        worldgen.office(seed, (24.0, 12.0))
        worldgen.warehouse(seed, (24.0, 16.0))
    assert len(widths) > 50
    assert min(widths) == pytest.approx(0.9)
    assert max(widths) == pytest.approx(1.2)


@pytest.mark.parametrize("kind", KINDS)
def test_walls_enclose_the_world_and_furniture_is_in_it(kind: str) -> None:
    world = worldgen.generate(kind, 4, SMALL)
    cells = world.grid.cells
    for border in (cells[:4], cells[-4:], cells[:, :4], cells[:, -4:]):
        assert (border == 100).all()
    assert world.furniture.any() == (kind != "maze")
    assert (cells[world.furniture] == 100).all()


def digest(world: worldgen.RandomWorld) -> str:
    files = world.files("some")
    return hashlib.sha256(b"".join(files[name] for name in sorted(files))).hexdigest()


def test_the_same_seed_gives_the_same_files_in_another_process() -> None:
    program = (
        "import hashlib\nfrom flatland import worldgen\n"
        f"{inspect.getsource(digest)}\n"
        f"for kind in worldgen.KINDS: print(digest(worldgen.generate(kind, 7, {SMALL})))"
    )
    done = run_program([sys.executable, "-c", program], check=True)
    digests = [digest(worldgen.generate(kind, 7, SMALL)) for kind in KINDS]
    assert done.stdout.split() == digests
    assert digest(worldgen.generate("maze", 8, SMALL)) not in digests


@pytest.mark.parametrize("kind", KINDS)
def test_the_files_are_a_world_that_runs(kind: str, tmp_path: Path) -> None:
    generated = worldgen.generate(kind, 5, SMALL)
    path = generated.write(tmp_path / "lab")
    assert path == tmp_path / "lab" / "world.yaml"
    assert sorted(p.name for p in path.parent.iterdir()) == sorted(generated.files())
    assert f"seed {generated.seed}" in path.read_text()
    assert "@" not in path.read_text()
    with flatland.World.from_yaml(path, seed=1) as world:
        assert world.model("robot").pose == pytest.approx(generated.start, abs=1e-3)
        assert world.is_free(generated.start, 0.3, ignore=["robot"])
        scan = world.output("/scan")
        for _ in range(2):
            world.command("/cmd_vel").set(flatland.Twist(angular_z=1.0))
            world.step(100)
        assert abs(world.model("robot").pose[2]) > 0.5
        assert np.isfinite(scan.latest.ranges).all()  # walls all around
        # Within the range of random numbers, all free places are connected.
        free = world.sample_free(30, 0.3, rng=1, connected_to=generated.start[:2])
        assert (np.ptp(free[:, :2], axis=0) > np.array(SMALL) / 2).all()
        # The same map as a grid.
        before = len(world.layer("walls").edges)
        world.set_layer_map("walls", generated.grid)
        assert len(world.layer("walls").edges) == before


def test_another_robot_is_that_of_its_file(tmp_path: Path) -> None:
    robot = tmp_path / 'a "robot".yaml'
    generated = worldgen.maze(1, SMALL)
    with pytest.raises(flatland.WorldError, match=r"robot.* does not exist"):
        generated.write(tmp_path / "lab", robot=robot)
    robot.write_text(
        "bodies: [{name: base, footprints: [{type: circle, radius: 0.1, density: 1}]}]"
    )
    path = generated.write(tmp_path / "lab", robot=robot)
    assert not (path.parent / "robot.model.yaml").exists()
    with flatland.World.from_yaml(path) as world:
        assert [body.name for body in world.model("robot").bodies] == ["base"]


def test_a_full_disk_leaves_no_folder(tmp_path: Path) -> None:
    with limited_files(1000), pytest.raises(OSError, match=REASON) as caught:
        worldgen.maze(1, SMALL).write(tmp_path / "lab")
    assert caught.value.filename.startswith(f"{tmp_path}/lab/")
    assert list(tmp_path.iterdir()) == []


def test_an_existing_folder_is_not_changed(tmp_path: Path) -> None:
    world = worldgen.maze(1, SMALL)
    (tmp_path / "lab").mkdir()
    with pytest.raises(flatland.WorldError, match="lab exists"):
        world.write(tmp_path / "lab")
    with pytest.raises(flatland.WorldError, match="nowhere does not exist"):
        world.write(tmp_path / "nowhere" / "lab")
    assert [path.name for path in tmp_path.rglob("*")] == ["lab"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "castle"}, "kind must be one of office, maze, warehouse, got 'castle'"),
        ({"seed": -1}, "seed must be an integer of at least 0"),
        ({"seed": 1.5}, "seed must be an integer of at least 0"),
        ({"size": (11, 9)}, "size of a random office must be at least 12 x 10 m, got 11 x 9 m"),
        ({"size": (9, 60)}, "at least 12 x 10 m, got 9 x 60 m"),
        ({"size": (600, 20)}, "size must be at most 500 m along each side, got 600 x 20 m"),
        ({"size": (500, 499)}, "at most 40000000 cells, got 500 x 499 m"),
        ({"size": (math.nan, 20)}, "size must be finite"),
        ({"size": (20,)}, "size must be a width and a height in metres"),
        ({"size": "big"}, "size must be a width and a height in metres, got 'big'"),
        ({"resolution": 0.5}, "resolution must be from 0.02 to 0.1 m, got 0.5"),
        ({"radius": 0.0}, "radius must be from 0.1 to 0.45 m, got 0"),
        ({"radius": math.nan}, "radius must be from 0.1 to 0.45 m, got nan"),
    ],
)
def test_invalid_arguments(arguments: dict[str, Any], message: str) -> None:
    valid = {"kind": "office", "seed": 1, "size": SMALL}
    with pytest.raises(ValueError, match=message.replace("(", r"\(")):
        worldgen.generate(**(valid | arguments))
