"""Copies what clients look at out of a world, between two steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from flatland.geometry import DoubleArray
from flatland.plugin_api.ports import Output
from flatland.scene.description import LayerDescription, describe_layer
from flatland.scene.scans import ScanDescription
from flatland.values import Transform
from flatland.web.controller import WorldController
from flatland.web.inspection import Details, copy_details, outputs_of
from flatland.web.model_tracker import ModelChanges, ModelTracker
from flatland.web.numbers import find_number
from flatland.web.views import Demand
from flatland.world import World


@dataclass(frozen=True, slots=True, eq=False)
class CapturedWorld:
    """A copy of what clients look at.

    Attributes:
        time: Simulated time [s].
        paused: Whether the world is paused.
        rate: Target rate [Hz], None if there is none.
        lockstep: Whether time passes only on request.
        step_size: Simulated time of a step [s].
        changes: New, changed and removed models.
        layers: The layers, None if they were not demanded.
        motions: (x, y, theta, vx, vy, omega) of all bodies in the world frame, shape (n, 6).
        scans: New scans by the id of the laser.
        frames: The latest transforms, None if they were not demanded.
        details: Details of the inspected models.
        series: For each series, the latest value of its output and the path of the number in the
            value.
    """

    time: float
    paused: bool
    rate: float | None
    lockstep: bool
    step_size: float
    changes: ModelChanges
    layers: list[LayerDescription] | None
    motions: DoubleArray
    scans: dict[int, ScanDescription]
    frames: list[Transform] | None
    details: list[Details]
    series: dict[str, tuple[object, list[str]]]


class WorldCapture:
    """Captures one world; all methods must be called between two steps.

    Attributes:
        tracker: The models that were described.
    """

    def __init__(self, world: World, controller: WorldController, ids: Iterator[int]) -> None:
        """Creates a capture of a world; the first call of `take` describes all of its models.

        Args:
            world: The world.
            controller: Provides the rate.
            ids: Returns ids that have not been used.
        """
        self.tracker = ModelTracker(world, ids)
        self._world = world
        self._controller = controller
        self._wanted: dict[Output[Any], None] = {}
        self._wanted_for: object = None  # the part of the demand that `_wanted` was derived from
        self._series: dict[str, tuple[Output[Any], list[str]]] = {}
        self._measurements: dict[int, object] = {}  # the previous one of each sensor

    def take(self, demand: Demand) -> CapturedWorld:
        """Returns what is demanded, and marks the outputs that are needed for it as wanted."""
        world, tracker = self._world, self.tracker
        changes = tracker.update()
        self._want_outputs(demand, changes.layout)
        inspected = [tracker.models[n] for n in demand.inspected if n in tracker.models]
        return CapturedWorld(
            time=world.time,
            paused=world.paused,
            rate=self._controller.rate,
            lockstep=self._controller.lockstep,
            step_size=world.timekeeper.step_size,
            changes=changes,
            layers=[describe_layer(each) for each in world.layers] if demand.layers else None,
            motions=world.physics.motions(tracker.bodies),
            scans=self._new_scans() if demand.scans else {},
            frames=list(world.transforms.values()) if demand.frames else None,
            details=[copy_details(world, each) for each in inspected] if demand.details else [],
            series={name: (o.latest, path) for name, (o, path) in self._series.items()},
        )

    def end(self) -> None:
        """Withdraws the demand for outputs until the next call of `take`."""
        self._replace_wanted({})
        self._series, self._wanted_for = {}, None
        self._measurements.clear()

    def _want_outputs(self, demand: Demand, layout: bool) -> None:
        wanted_for = (demand.scans, demand.inspected, demand.series)
        if wanted_for == self._wanted_for and not layout:
            return
        world, tracker = self._world, self.tracker
        self._wanted_for = wanted_for
        if not demand.scans:
            self._measurements.clear()
        wanted = {sensor.output: None for sensor in tracker.sensors.values() if demand.scans}
        for number in demand.inspected:
            if number in tracker.models:
                wanted.update(dict.fromkeys(outputs_of(world, tracker.models[number])))
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

    def _new_scans(self) -> dict[int, ScanDescription]:
        sensors, former, found = self.tracker.sensors, self._measurements, {}
        self._measurements = {number: sensor.latest() for number, sensor in sensors.items()}
        for number, value in self._measurements.items():
            if value is None or former.get(number) is value:
                continue
            scan = sensors[number].scan_of(value)
            if scan is not None:
                found[number] = scan
        return found
