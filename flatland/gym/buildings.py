"""Several buildings, one of which is drawn for each episode."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from flatland import worldgen
from flatland.checks import checked_count, checked_path, shown
from flatland.gym.worlds import find_world, included_robot
from flatland.world import World
from flatland.worldgen.random_world import DEFAULT_RADIUS, DEFAULT_RESOLUTION

if TYPE_CHECKING:
    from flatland.config.inputs import Params

_MAX_COUNT: Final = 100_000


class Buildings:
    """World files, one of which is drawn for each episode.

    They must contain the same robot: lasers with as many beams of the same range, and drives with
    the same limits. The seed of a world is its index: if a file is given several times, its worlds
    differ in all that they draw, such as the places of people.

    Attributes:
        worlds: The world files, or the names of included worlds.
    """

    def __init__(self, worlds: Iterable[str | os.PathLike[str]]) -> None:
        """Creates the collection; the files are read when an environment is created.

        Args:
            worlds: World files, or names of included worlds, at least one.

        Raises:
            TypeError: A single file is given.
            ValueError: There is none.
        """
        if isinstance(worlds, str | os.PathLike) or not isinstance(worlds, Iterable):
            raise TypeError(f"worlds must be several files, got {shown(worlds)}")
        self.worlds = tuple(checked_path("each of worlds", each) for each in worlds)
        if not self.worlds:
            raise ValueError("worlds must contain at least one file")

    def __len__(self) -> int:
        """Returns the number of buildings."""
        return len(self.worlds)

    @property
    def name(self) -> str:
        """The name of the collection for users."""
        return f"{len(self)} buildings"

    def load(self, number: int, params: Params, step_size: float) -> World:
        """Loads a building.

        Args:
            number: Its index.
            params: Values of `param()` in YAML files.
            step_size: Simulated time of a step [s].

        Raises:
            FlatlandError: A file is missing or invalid.
        """
        path = find_world(self.worlds[number])
        return World.from_yaml(path, seed=number, params=params, step_size=step_size)


class RandomBuildings(Buildings):
    """Random worlds with successive seeds; see `flatland.worldgen`.

    Attributes:
        kind: `office`, `maze` or `warehouse`.
        first_seed: Seed of the first building.
        size: Width and height [m].
        robot: Model file of the robot; None for the included one.
        resolution: Size of a cell of the maps [m].
        radius: Radius of the disc that reaches all free places [m].
    """

    def __init__(
        self,
        kind: str,
        count: int = 32,
        *,
        first_seed: int = 0,
        size: tuple[float, float] = (20.0, 14.0),
        robot: str | os.PathLike[str] | None = None,
        resolution: float = DEFAULT_RESOLUTION,
        radius: float = DEFAULT_RADIUS,
    ) -> None:
        """Creates the collection; the worlds are generated when an environment is created.

        Args:
            kind: `office`, `maze` or `warehouse`.
            count: Number of buildings.
            first_seed: Seed of the first building; that of others is greater by their index.
            size: Width and height [m].
            robot: Model file of the robot; None for the included one.
            resolution: Size of a cell of the maps [m].
            radius: Radius of the disc that reaches all free places [m].

        Raises:
            ValueError: The kind is unknown, or an integer is out of range.
        """
        if kind not in worldgen.KINDS:
            raise ValueError(f"kind must be one of {', '.join(worldgen.KINDS)}, got {kind!r}")
        self.kind = kind
        self.first_seed = checked_count("first_seed", first_seed, 0)
        self.size = size
        self.robot = robot
        self.resolution = resolution
        self.radius = radius
        super().__init__(
            f"{kind}_{number}" for number in range(checked_count("count", count, 1, _MAX_COUNT))
        )

    def load(self, number: int, params: Params, step_size: float) -> World:
        """Generates and loads a building.

        Raises:
            FlatlandError: The model file is missing or invalid.
            ValueError: The size, the resolution or the radius is out of range.
        """
        generated = worldgen.generate(
            self.kind,
            self.first_seed + number,
            self.size,
            resolution=self.resolution,
            radius=self.radius,
        )
        with tempfile.TemporaryDirectory() as folder:
            robot = included_robot() if self.robot is None else self.robot
            path = generated.write(Path(folder) / self.worlds[number], robot=robot)
            return World.from_yaml(path, seed=number, params=params, step_size=step_size)
