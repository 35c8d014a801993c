"""The loop that steps a world in real time or as fast as possible."""

from flatland.defaults import MAX_LAG
from flatland.simulation.cycle_statistics import CycleStatistics
from flatland.simulation.pause_holds import PauseHolds
from flatland.simulation.simulation import RunResult, Simulation

__all__ = ["MAX_LAG", "CycleStatistics", "PauseHolds", "RunResult", "Simulation"]
