from __future__ import annotations
from collections.abc import Sequence
from typing import TYPE_CHECKING
from flatland.geometry import FloatArray
if TYPE_CHECKING:
    from flatland.plugins.laser import Laser
    from flatland.world import World

def compute_scans(lasers, out=None, num_threads=0):
    for i, l in enumerate(lasers):
        out[i] = l.compute_ranges()
    return out
