"""A plugin that records the start of each cycle. Its model must be the first one of the world."""

from __future__ import annotations

import time
from array import array

import numpy as np

import flatland

MANIFEST = """
<library path="{folder}">
  <class name="bench::Recorder" type="recorder.Recorder" base_class_type="flatland::ModelPlugin"/>
</library>
"""
MODEL = """
bodies: [{{name: base, footprints: []}}]
plugins: [{{name: recorder, type: "bench::Recorder", file: "{file}"}}]
"""


class Recorder(flatland.ModelPlugin):
    """Records the wall time of each cycle start [s], and saves all of them on shutdown."""

    def on_initialize(self, config: flatland.YamlReader) -> None:
        self._file: str = config.get("file", "string")
        self._starts = array("d")

    def before_physics_step(self, timekeeper: flatland.Timekeeper) -> None:
        self._starts.append(time.perf_counter())

    def on_shutdown(self) -> None:
        np.save(self._file, np.array(self._starts))
