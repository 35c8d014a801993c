"""The scans that a controller receives, and the failures of its laser."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flatland.errors import WorldError
from flatland.geometry import compose, invert, transform_points
from flatland.scenarios.task import Scan

if TYPE_CHECKING:
    from flatland.entities.model import Model
    from flatland.geometry import DoubleArray, FloatArray
    from flatland.plugins.laser import Laser
    from flatland.scenarios.scenario import Fault
    from flatland.values import LaserScan
    from flatland.world import World


class LaserReader:
    """Reads the published scans of a laser."""

    def __init__(self, world: World, robot: Model, laser: Laser) -> None:
        """Makes the scans wanted.

        Raises:
            WorldError: The laser has no output.
        """
        for output in world.ports.outputs.values():
            if output in laser._outputs:
                self._output = world.output(output.topic)
                break
        else:
            raise WorldError(f'the laser "{laser.name}" of "{robot.name}" has no topic')
        self._world = world
        self._laser = laser
        self._mount = compose(compose(invert(robot.pose), laser.body.pose), laser.origin)
        self._fault: Fault | None = None
        self._fault_end = math.inf
        self._last = Scan(*self._convert(np.full(laser.angles.count, np.nan)))

    def fail(self, fault: Fault, duration: float | None) -> None:
        """Makes the laser fail.

        Args:
            fault: How it fails.
            duration: Simulated time until it works again [s]; None for never.
        """
        self._fault = fault
        self._fault_end = math.inf if duration is None else self._world.time + duration

    def read(self) -> Scan:
        """Returns the last scan, or that of the failed laser."""
        if self._world.time >= self._fault_end:
            self._fault = None
        if self._fault == "frozen":
            return self._last
        latest: LaserScan | None = self._output.latest
        if self._fault == "blind" or latest is None:
            return Scan(*self._convert(np.full(self._laser.angles.count, np.nan)))
        self._last = Scan(*self._convert(latest.ranges))
        return self._last

    def _convert(
        self, measured: FloatArray | DoubleArray
    ) -> tuple[DoubleArray, float, DoubleArray]:
        laser = self._laser
        is_hit = np.isfinite(measured) & (measured < np.float32(laser.range))
        ranges = np.where(is_hit, measured.astype(np.float64), laser.range)
        ranges[np.isneginf(measured)] = 0.0
        p_laser = laser.beam_ends[is_hit] * (ranges[is_hit] / laser.range)[:, np.newaxis]
        return ranges, laser.range, transform_points(self._mount, p_laser)
