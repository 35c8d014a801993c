"""The loop that steps a world in real time or as fast as possible."""

from flatland.simulation.cycle_statistics import CycleStatistics
from flatland.simulation.simulation import MAX_LAG, RunResult, Simulation

__all__ = ["MAX_LAG", "CycleStatistics", "RunResult", "Simulation"]
