"""A range finder that knows what its beams hit: labels for learning perception."""

from __future__ import annotations

import fnmatch
from typing import TYPE_CHECKING

from flatland import values
from flatland.entities.collision_filter import ALL_LAYERS
from flatland.errors import WorldError
from flatland.physics import RangeFinder
from flatland.plugin_api.after_step import update_after_step
from flatland.plugin_api.parameters import read_body, read_pose, read_rate
from flatland.plugin_api.plugin import ModelPlugin
from flatland.plugin_api.schedule import when_due
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.plugins._beams import (
    BeamAngles,
    read_layers,
    read_no_hit,
    read_range,
    read_range_min,
)
from flatland.plugins._range_noise import read_range_noise

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.geometry import Pose
    from flatland.timekeeper import Timekeeper

NO_LABEL = values.SemanticLabel("", "", (), "")


class SemanticScan(ModelPlugin):
    """Emits scans with the name and the class of what each beam hit.

    Attributes:
        body: The body on which the sensor is mounted.
        angles: Angles of the beams.
        range: Length of a beam [m].
        range_min: Shortest range that is measured [m]; a shorter one is reported as -inf.
        origin: (x, y, theta) of the sensor in the body frame.
        classes: Classes by pattern of the names of models, layers or `model/body`; the first
            pattern that matches counts.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the output.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: The topic is not a legal name.
        """
        self.body = read_body(config, self.model)
        self.range = read_range(config)
        self.range_min = read_range_min(config, self.range)
        self.angles = BeamAngles.from_config(config.subnode("angle", "map"))
        self.origin = read_pose(config, "origin")
        self.classes = self._read_classes(config)
        self._timer = UpdateTimer(read_rate(config))
        hook = update_after_step(self, config, self._timer)
        noise = read_range_noise(config, self.range)
        self._noise = self.noise_stream("semantic_scan")
        self._sends_transform: bool = config.get("broadcast_tf", "bool", True)
        self._body_frame_id = self.model.frame(self.body.name)
        self.frame_id = self.model.frame(config.get("frame", "string", self.name))
        self._finder = RangeFinder(
            self.angles.fan(self.range, False),
            self.range,
            origin=self.origin,
            mask=read_layers(config, self.world),
            range_min=self.range_min,
            no_hit=read_no_hit(config, self.range),
            noise=noise,
        )
        self._output = self.output(
            config.get("topic", "string", "semantic_scan"), values.SemanticScan
        )
        self.call_when_due(
            hook,
            self._timer,
            outputs=[self._output],
            transforms=self._sends_transform,
            skipped=self._skip,
        )

    @staticmethod
    def _read_classes(config: YamlReader) -> dict[str, str]:
        if "classes" not in config:
            return {}
        entries = config.subnode("classes", "map")
        patterns = entries.keys()
        classes = {pattern: entries.get(pattern, "string") for pattern in patterns}
        for pattern, name in classes.items():
            if not name:
                entries.report(entries.invalid(pattern, "the name of a class must not be empty"))
        return classes

    @when_due
    def before_physics_step(self, timekeeper: Timekeeper) -> None:
        """Sends the transform and emits a scan, if it is wanted, when an update is due."""
        if not self._timer.check_update(timekeeper):
            return
        self._noise.begin_update()
        if self._sends_transform:
            self.send_transform(self._body_frame_id, self.frame_id, *self.origin)
        if self._output.wanted:
            self._output.emit(self._measure(timekeeper.sim_time_ns))

    def _measure(self, stamp: int) -> values.SemanticScan:
        scan = self._finder.scan_labels(self.body, self._noise.key, self._noise.updates)
        return values.SemanticScan(
            stamp=stamp,
            frame_id=self.frame_id,
            angle_min=self.angles.minimum,
            angle_max=self.angles.maximum,
            angle_increment=self.angles.increment,
            range_min=self.range_min,
            range_max=self.range,
            ranges=scan.ranges,
            labels=scan.labels,
            table=(NO_LABEL, *(self._label_of(*hit) for hit in scan.hits)),
        )

    def _label_of(self, body_id: int, category_bits: int) -> values.SemanticLabel:
        """Returns the label of a body and of the categories of the fixture that was hit."""
        layers = self._layers(category_bits)
        try:
            body = self.world.body_of_id(body_id)
        except WorldError:  # A plugin has added it to the physics world only.
            return values.SemanticLabel("", "", layers, "")
        name = body.entity.name
        return values.SemanticLabel(name, body.name, layers, self._class_of(name, body))

    def _class_of(self, name: str, body: Body) -> str:
        for pattern, class_name in self.classes.items():
            if fnmatch.fnmatchcase(name, pattern) or fnmatch.fnmatchcase(
                f"{name}/{body.name}", pattern
            ):
                return class_name
        return body.class_name

    def _layers(self, category_bits: int) -> tuple[str, ...]:
        if category_bits == ALL_LAYERS:
            return ("all",)
        names = self.world.collision_filter.names
        return tuple(name for i, name in enumerate(names) if category_bits >> i & 1)

    def _skip(self, count: int, stamp: int, poses: tuple[Pose, ...]) -> None:
        """Accounts for skipped updates; see `FlatlandPlugin.call_when_due`."""
        del poses
        self._noise.begin_update(count)
        if self._sends_transform:
            self.send_past_transform(stamp, self._body_frame_id, self.frame_id, *self.origin)
