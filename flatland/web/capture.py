"""Copies what clients look at out of a world, between two steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from flatland.geometry import DoubleArray, FloatArray, Pose
from flatland.plugin_api.ports import Output
from flatland.values import Transform
from flatland.web.controller import WorldController
from flatland.web.inspection import Details, copy_details, outputs_of
from flatland.web.numbers import find_number
from flatland.web.scene import LayerContents, Scene, SceneChange, copy_layers
from flatland.world import World


@dataclass(frozen=True, slots=True)
class Demand:
    """What the clients of a world look at.

    Attributes:
        scans: Whether laser scans are wanted.
        layers: Whether the layers have to be copied, because they are new or have changed.
        frames: Whether the transforms have to be copied.
        inspected: Ids of the models that are inspected.
        details: Whether their details have to be copied.
        series: Names of the numbers that are plotted.
    """

    scans: bool = False
    layers: bool = False
    frames: bool = False
    inspected: frozenset[int] = frozenset()
    details: bool = False
    series: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, eq=False)
class NewScan:
    """A scan that was not captured before.

    Attributes:
        laser: Id of the laser.
        pose: Pose of the laser in the world frame at the time of the scan [m, rad].
        ranges: Range of each beam [m], shape (n,); not changed by anybody.
    """

    laser: int
    pose: Pose
    ranges: FloatArray


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
        frames: The latest transforms, None if they were not demanded.
        details: Details of the inspected models.
        series: Latest value of the output of each series, and the path of the number in it.
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
    frames: list[Transform] | None
    details: list[Details]
    series: dict[str, tuple[object, list[str]]]


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
        self._wanted: dict[Output[Any], None] = {}
        self._series: dict[str, tuple[Output[Any], list[str]]] = {}
        self._wanted_for: object = None
        self._last: dict[int, object] = {}

    def take(self, demand: Demand) -> Captured:
        """Returns the current state.

        Args:
            demand: What is looked at.
        """
        world, scene = self._world, self.scene
        change = scene.update()
        self._want(demand, change.layout)
        inspected = [scene.models[n] for n in demand.inspected if n in scene.models]
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
            frames=list(world.transforms.values()) if demand.frames else None,
            details=[copy_details(world, known) for known in inspected] if demand.details else [],
            series={name: (o.latest, path) for name, (o, path) in self._series.items()},
        )

    def end(self) -> None:
        """Ends the demand for outputs, until the next call of `take`."""
        self._replace_wanted({})
        self._series, self._wanted_for = {}, None
        self._last.clear()

    def _want(self, demand: Demand, layout: bool) -> None:
        """Has the outputs computed that are looked at."""
        wanted_for = (demand.scans, demand.inspected, demand.series)
        if wanted_for == self._wanted_for and not layout:
            return
        world, scene = self._world, self.scene
        self._wanted_for = wanted_for
        if not demand.scans:
            self._last.clear()
        wanted = {sensor.output: None for sensor in scene.lasers.values() if demand.scans}
        for number in demand.inspected:
            if number in scene.models:
                wanted.update(dict.fromkeys(outputs_of(world, scene.models[number])))
        outputs = world.ports.outputs if demand.series else {}
        found = {name: find_number(outputs, name) for name in demand.series}
        self._series = {name: series for name, series in found.items() if series is not None}
        wanted.update(dict.fromkeys(output for output, _ in self._series.values()))
        self._replace_wanted(wanted)

    def _replace_wanted(self, wanted: dict[Output[Any], None]) -> None:
        former, self._wanted = self._wanted, wanted
        for output in wanted:
            if output not in former:
                output.want(self)
        for output in former:
            if output not in wanted:
                output.unwant(self)

    def _new_scans(self) -> list[NewScan]:
        sensors, last, found = self.scene.lasers, self._last, []
        self._last = {number: sensor.latest() for number, sensor in sensors.items()}
        for number, value in self._last.items():
            if value is None or last.get(number) is value:
                continue
            scan = sensors[number].scan_of(value)
            if scan is not None:
                found.append(NewScan(number, *scan))
        return found
