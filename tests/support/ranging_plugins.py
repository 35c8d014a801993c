"""Sensors that measure ranges, but are no lasers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flatland import ModelPlugin, Timekeeper, YamlReader
from flatland.plugins.laser import BeamAngles
from flatland.values import LaserScan


@dataclass(frozen=True)
class Distance:
    """A single distance, as of a sonar."""

    range: float


class Fan(ModelPlugin):
    """A sensor with three beams that always measures the same."""

    def on_initialize(self, config: YamlReader) -> None:
        self.body, self.range, self.origin = self.model.bodies[0], 8.0, (1.0, 0.0, 0.0)
        self.angles = BeamAngles(-0.5, 0.5, 0.5, 3)
        self.scan = self.output("fan", LaserScan)

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        ranges = np.array([1, 2, np.inf], np.float32)
        scan = LaserScan(0, "fan", -0.5, 0.5, 0.5, 0, 0, 0, 8, ranges, np.zeros(0, np.float32))
        self.scan.emit(scan)


class Cone(ModelPlugin):
    """A sensor with a cone that always measures the same."""

    def on_initialize(self, config: YamlReader) -> None:
        self.body, self.range, self.field_of_view = self.model.bodies[0], 4.0, 0.8
        self.distance = self.output("cone", Distance)

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        self.distance.emit(Distance(3.0))
