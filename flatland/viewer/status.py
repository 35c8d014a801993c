"""The line below the picture: the simulated time, how fast it passes, and how fast it is to."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from PyQt5.QtCore import Qt, QTimer, pyqtSignal
from PyQt5.QtWidgets import QLabel, QSlider, QStatusBar

from flatland.viewer import rate_scale
from flatland.viewer.real_time_factor import RealTimeFactor
from flatland.viewer.server import ServerState

_LOOK_EVERY: Final = 100  # ms between two looks at the simulated time
_SETTLED_AFTER: Final = 200  # ms without a move of the slider before its rate is asked for
_MESSAGE_STAYS: Final = 8000  # ms
_WAITING: Final = "waiting for the simulator"


class Status(QStatusBar):
    """Shows the state of the simulator and sets its rate."""

    rate_wanted = pyqtSignal(float)  # steps in a second [Hz], 0 for as many as possible

    def __init__(self, simulated_time: Callable[[], float]) -> None:
        """Makes the line.

        Args:
            simulated_time: Gives the simulated time [s].
        """
        super().__init__()
        self._simulated_time = simulated_time
        self._factor = RealTimeFactor()
        self._state = ServerState(running=False)
        self._paused = False
        self.time = _label("time", "simulated time")
        self.factor = _label("factor", "simulated time over wall time", "real-time factor 000.00")
        # The slider is not to move under the mouse when the text beside it gets longer.
        self.rate = _label(
            "rate", "steps in a second, and how much faster than real time that is", _WAITING
        )
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setObjectName("rate_slider")
        self.slider.setToolTip("how fast the simulated time is to pass")
        self.slider.setRange(0, rate_scale.FASTEST)
        self.slider.setFixedWidth(180)
        self.slider.setEnabled(False)
        for widget in (self.time, self.factor, self.slider, self.rate):
            self.addPermanentWidget(widget)
        self._clock = QTimer(self)
        self._clock.timeout.connect(self._look_at_clock)
        self._clock.start(_LOOK_EVERY)
        self._settled = QTimer(self)
        self._settled.setSingleShot(True)
        self._settled.setInterval(_SETTLED_AFTER)
        self._settled.timeout.connect(self._ask_for_rate)
        self.slider.valueChanged.connect(self._slide)
        self.show_state(self._state)

    def show_state(self, state: ServerState) -> None:
        """Shows the rate that the simulator has."""
        self._state = state
        self.slider.setEnabled(state.running)
        if not state.running:
            self.rate.setText(_WAITING)
            return
        if self._settled.isActive() or self.slider.isSliderDown():
            return  # What the user is about to ask for counts.
        self.slider.blockSignals(True)
        self.slider.setValue(rate_scale.position_of(state.update_rate, state.step_size))
        self.slider.blockSignals(False)
        self.rate.setText(rate_scale.describe(state.update_rate, state.step_size))

    def show_paused(self, paused: bool) -> None:
        """Shows whether the simulated time stands still on purpose."""
        self._paused = paused

    def say(self, text: str) -> None:
        """Shows a message for some seconds."""
        self.showMessage(text, _MESSAGE_STAYS)

    def show_last_state(self) -> None:
        """Puts the slider back to what the simulator has."""
        self.show_state(self._state)

    def _look_at_clock(self) -> None:
        simulated = self._simulated_time()
        factor = self._factor.add(simulated, time.monotonic())
        self.time.setText(f"time {simulated:.2f} s")
        if not self._state.running:
            self.factor.setText("")
        elif self._paused:
            self.factor.setText("paused")
        else:
            self.factor.setText("" if factor is None else f"real-time factor {factor:.2f}")

    def _slide(self, position: int) -> None:
        rate = rate_scale.rate_at(position, self._state.step_size)
        self.rate.setText(rate_scale.describe(rate, self._state.step_size))
        self._settled.start()

    def _ask_for_rate(self) -> None:
        self.rate_wanted.emit(rate_scale.rate_at(self.slider.value(), self._state.step_size))


def _label(name: str, tip: str, widest: str = "") -> QLabel:
    """Makes a label that has room for its widest text from the beginning."""
    label = QLabel(widest)
    label.setMinimumWidth(label.sizeHint().width())
    label.clear()
    label.setObjectName(name)
    label.setToolTip(tip)
    return label
