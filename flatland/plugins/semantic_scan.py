"""A range finder that labels what its beams hit, for learning perception."""

from __future__ import annotations

import fnmatch
from typing import TYPE_CHECKING

from flatland import values
from flatland.entities.collision_filter import ALL_LAYERS
from flatland.errors import WorldError
from flatland.physics import RangeFinder
from flatland.plugin_api.parameters import read_pose
from flatland.plugins._beams import BeamAngles, read_layers, read_no_hit
from flatland.plugins._range_sensor import RangeSensor

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body

NO_LABEL = values.SemanticLabel("", "", (), "")


class SemanticScan(RangeSensor):
    """Emits scans with the name and the class of what each beam hit.

    Attributes:
        angles: Angles of the beams.
        classes: Classes by pattern of the names of models, layers or `model/body`; the first
            pattern that matches counts.
    """

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the output.

        Raises:
            YamlError: A parameter is invalid.
            PluginError: The topic is not a legal name.
        """
        self._read_mounting(config)
        self.angles = BeamAngles.from_config(config)
        self.origin = read_pose(config, "origin")
        self.classes = self._read_classes(config)
        noise = self._read_updates(config, "semantic_scan")
        self._finder = RangeFinder(
            self.angles.fan(self.range, False),
            self.range,
            origin=self.origin,
            mask=read_layers(config, self.world),
            range_min=self.range_min,
            no_hit=read_no_hit(config, self.range),
            noise=noise,
            out_of_range=self._out_of_range,
        )
        topic = config.get("topic", "string", "semantic_scan")
        self._start(self.output(topic, values.SemanticScan))

    @staticmethod
    def _read_classes(config: YamlReader) -> dict[str, str]:
        entries = config.optional_subnode("classes", "map")
        if entries.is_null:
            return {}
        patterns = entries.keys()
        classes = {pattern: entries.get(pattern, "string") for pattern in patterns}
        for pattern, name in classes.items():
            if not name:
                entries.report(entries.invalid(pattern, "the name of a class must not be empty"))
        return classes

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
        return tuple(self.world.collision_filter.names_of(category_bits))
