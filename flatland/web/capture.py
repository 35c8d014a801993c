"""Copies what clients look at out of a world, between two steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from flatland.geometry import DoubleArray, FloatArray, Pose
from flatland.plugin_api.ports import Output
from flatland.web.controller import WorldController
from flatland.web.scene import LayerContents, Scene, SceneChange, copy_layers
from flatland.world import World


@dataclass(frozen=True, slots=True)
class Demand:
    """What the clients of a world look at.

    Attributes:
        scans: Whether laser scans are wanted.
        layers: Whether the layers have to be copied, because they are new or have changed.
    """

    scans: bool = False
    layers: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class NewScan:
    """A scan that was not captured before.

    Attributes:
        laser: Id of the laser.
        pose: Pose of the laser in the world frame at the time of the scan [m, rad].
        ranges: Range of each beam [m], shape (n,); not changed by anybody.
        range_max: Maximum range [m].
    """

    laser: int
    pose: Pose
    ranges: FloatArray
    range_max: float


@dataclass(frozen=True, slots=True, eq=False)
class Captured:
    """The state of a world between two steps.

    Attributes:
        time: Simulated time [s].
        paused: Whether the world is paused.
        rate: Target rate [Hz], None if there is none.
        lockstep: Whether time passes only on request.
        step_size: Simulated time of a step [s].
        change: New, changed and removed models.
        layers: Copies of the layers, None if they were not demanded.
        motions: (x, y, theta, vx, vy, omega) of all bodies in the world frame, shape (n, 6).
        scans: Scans that are new.
    """

    time: float
    paused: bool
    rate: float | None
    lockstep: bool
    step_size: float
    change: SceneChange
    layers: list[LayerContents] | None
    motions: DoubleArray
    scans: list[NewScan]


class Capture:
    """Captures the state of one world; its methods are called between two steps.

    Attributes:
        scene: The models that clients know.
    """

    def __init__(self, world: World, controller: WorldController, ids: Iterator[int]) -> None:
        """Creates a capture that knows nothing yet.

        Args:
            world: The world.
            controller: Knows the rate.
            ids: Returns ids that have not been used.
        """
        self.scene = Scene(world, ids)
        self._world = world
        self._controller = controller
        self._wanted: dict[int, Output[Any]] = {}
        self._last: dict[int, object] = {}

    def take(self, demand: Demand) -> Captured:
        """Returns the current state.

        Args:
            demand: What is looked at.
        """
        world, scene = self._world, self.scene
        change = scene.update()
        self._want_scans(demand.scans)
        return Captured(
            time=world.time,
            paused=world.paused,
            rate=self._controller.rate,
            lockstep=self._controller.lockstep,
            step_size=world.timekeeper.step_size,
            change=change,
            layers=copy_layers(world) if demand.layers else None,
            motions=world.physics.motions(scene.bodies),
            scans=self._new_scans() if demand.scans else [],
        )

    def end(self) -> None:
        """Ends the demand for scans; safe from any thread once `take` is not called any more."""
        self._want_scans(False)

    def _want_scans(self, wanted: bool) -> None:
        lasers = self.scene.lasers if wanted else {}
        if lasers.keys() == self._wanted.keys():
            return
        for number, output in self._wanted.items():
            if number not in lasers:
                output.unwant(self)
                self._last.pop(number, None)
        for number, (_laser, output) in lasers.items():
            if number not in self._wanted:
                output.want(self)
        self._wanted = {number: output for number, (_laser, output) in lasers.items()}

    def _new_scans(self) -> list[NewScan]:
        last, found = self._last, []
        for number, (laser, _output) in self.scene.lasers.items():
            scan = laser.last_scan
            if scan is None or last.get(number) is scan:
                continue
            last[number] = scan
            pose, ranges = scan
            # The caller of `compute_scans` may overwrite an array of its own.
            found.append(
                NewScan(number, pose, ranges if ranges.base is None else ranges.copy(), laser.range)
            )
        return found
