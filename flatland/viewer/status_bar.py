"""The status bar: simulated time, real-time factor and a slider for the update rate."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Final

from PyQt5.QtCore import Qt, QTimer, pyqtSignal
from PyQt5.QtWidgets import QLabel, QSlider, QStatusBar

from flatland.viewer.simulator_client import SimulatorState

RATE_FACTORS: Final = (
    *(0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7),
    *(1.0, 1.5, 2.0, 3.0, 5.0, 7.0),
    *(10.0, 15.0, 20.0, 30.0, 50.0),
)
"""Target real-time factors at the positions of the rate slider, but for its last position."""

UNLIMITED_POSITION: Final = len(RATE_FACTORS)
"""The last position of the rate slider: as fast as possible."""

_FACTOR_WINDOW: Final = 1.5  # s of wall time over which the real-time factor is measured
_TIME_POLL_PERIOD: Final = 0.1  # s
_SLIDER_DELAY: Final = 200  # ms without slider movement before the rate is requested
_MESSAGE_DURATION: Final = 8000  # ms
_WAITING: Final = "Waiting for the simulator"


def rate_at_position(position: int, step_size: float) -> float:
    """Returns the update rate [Hz] at a position of the slider, 0 for as fast as possible."""
    if position >= UNLIMITED_POSITION:
        return 0.0
    # Twelve digits remove the rounding error of the division, for example of 1 / 0.005.
    return float(f"{RATE_FACTORS[position] / step_size:.12g}")


def position_of_rate(rate: float, step_size: float) -> int:
    """Returns the position of the slider nearest to an update rate [Hz]."""
    if rate == 0 or math.isinf(rate):
        return UNLIMITED_POSITION
    target = math.log(rate * step_size)
    return min(
        range(UNLIMITED_POSITION), key=lambda index: abs(math.log(RATE_FACTORS[index]) - target)
    )


def format_rate(rate: float, step_size: float) -> str:
    """Formats an update rate [Hz] with its target real-time factor."""
    if rate == 0 or math.isinf(rate):
        return "as fast as possible"
    return f"{rate:.4g} Hz (x{rate * step_size:.3g})"


class RealTimeFactor:
    """Measures simulated time per wall time over a sliding window of 1.5 s."""

    def __init__(self) -> None:
        """Starts without samples."""
        self._samples: deque[tuple[float, float]] = deque()

    def add(self, simulated: float, wall: float) -> float | None:
        """Adds a sample of both clocks [s].

        Returns:
            The real-time factor, None if the samples span less than a third of the window.
        """
        samples = self._samples
        if samples and simulated < samples[-1][0]:
            samples.clear()  # The simulator was restarted.
        samples.append((simulated, wall))
        while len(samples) > 2 and wall - samples[1][1] >= _FACTOR_WINDOW:
            samples.popleft()
        elapsed = wall - samples[0][1]
        return (simulated - samples[0][0]) / elapsed if elapsed >= _FACTOR_WINDOW / 3 else None


class StatusBar(QStatusBar):
    """Shows the state of the simulator, with a field to set its update rate."""

    rate_requested = pyqtSignal(float)  # steps per second [Hz], 0 for as fast as possible

    def __init__(self, simulated_time: Callable[[], float]) -> None:
        """Creates the status bar.

        Args:
            simulated_time: Returns the simulated time [s].
        """
        super().__init__()
        self._simulated_time = simulated_time
        self._factor = RealTimeFactor()
        self._state = SimulatorState(running=False)
        self._paused = False
        self.time = _label("time", "Simulated time")
        self.factor = _label("factor", "Simulated time per wall time", "Real-time factor: 000.00")
        # The slider must not move under the mouse when the text beside it changes.
        self.rate = _label(
            "rate", "Steps per second of wall time, and the target real-time factor", _WAITING
        )
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setObjectName("rate_slider")
        self.slider.setToolTip("Update rate of the simulation")
        self.slider.setRange(0, UNLIMITED_POSITION)
        self.slider.setFixedWidth(180)
        self.slider.setEnabled(False)
        for widget in (self.time, self.factor, QLabel("Update rate:"), self.slider, self.rate):
            self.addPermanentWidget(widget)
        self._time_timer = QTimer(self)
        self._time_timer.timeout.connect(self._update_time)
        self._time_timer.start(round(1000 * _TIME_POLL_PERIOD))
        self._slider_timer = QTimer(self)
        self._slider_timer.setSingleShot(True)
        self._slider_timer.setInterval(_SLIDER_DELAY)
        self._slider_timer.timeout.connect(self._request_rate)
        self.slider.valueChanged.connect(self._on_slider_moved)
        self.show_state(self._state)

    def show_state(self, state: SimulatorState) -> None:
        """Shows the update rate of the simulator."""
        self._state = state
        self.slider.setEnabled(state.running)
        if not state.running:
            self.rate.setText(_WAITING)
            return
        if self._slider_timer.isActive() or self.slider.isSliderDown():
            return  # Keep the rate that the user is about to request.
        self.slider.blockSignals(True)
        self.slider.setValue(position_of_rate(state.update_rate, state.step_size))
        self.slider.blockSignals(False)
        self.rate.setText(format_rate(state.update_rate, state.step_size))

    def show_paused(self, paused: bool) -> None:
        """Shows whether the simulation is paused."""
        self._paused = paused

    def show_temporary_message(self, text: str) -> None:
        """Shows a message for eight seconds."""
        self.showMessage(text, _MESSAGE_DURATION)

    def reset_rate(self) -> None:
        """Sets the slider back to the update rate of the simulator."""
        self.show_state(self._state)

    def _update_time(self) -> None:
        simulated = self._simulated_time()
        factor = self._factor.add(simulated, time.monotonic())
        self.time.setText(f"Time: {simulated:.2f} s")
        if not self._state.running:
            self.factor.setText("")
        elif self._paused:
            self.factor.setText("Paused")
        else:
            self.factor.setText("" if factor is None else f"Real-time factor: {factor:.2f}")

    def _on_slider_moved(self, position: int) -> None:
        rate = rate_at_position(position, self._state.step_size)
        self.rate.setText(format_rate(rate, self._state.step_size))
        self._slider_timer.start()

    def _request_rate(self) -> None:
        self.rate_requested.emit(rate_at_position(self.slider.value(), self._state.step_size))


def _label(name: str, tool_tip: str, widest: str = "") -> QLabel:
    """Creates an empty label that is at least as wide as the given text."""
    label = QLabel(widest)
    label.setMinimumWidth(label.sizeHint().width())
    label.clear()
    label.setObjectName(name)
    label.setToolTip(tool_tip)
    return label
