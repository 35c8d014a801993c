"""A battery that is discharged by driving."""

import math
from dataclasses import dataclass

from flatland import ModelPlugin, Timekeeper, UpdateTimer, YamlReader
from flatland.plugins.parameters import read_body_or_first, read_rate


@dataclass(frozen=True)
class BatteryReading:
    """State of a battery.

    Attributes:
        stamp: Simulated time [ns].
        voltage: Voltage [V].
        capacity: Energy of the full battery [Wh].
        energy: Remaining energy [Wh].
        power: Charging power [W], negative while the battery is discharged.
    """

    stamp: int
    voltage: float
    capacity: float
    energy: float
    power: float

    @property
    def fraction(self) -> float:
        """State of charge, from 0 to 1."""
        return self.energy / self.capacity


class Battery(ModelPlugin):
    """Is discharged by idling and driving, and charged while the command `recharge` is true."""

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the ports."""
        self._body = read_body_or_first(config, self.model, "body")
        self._timer = UpdateTimer(read_rate(config, default=1.0))
        self._voltage = read_amount(config, "voltage", 24.0, positive=True)
        self._capacity = read_amount(config, "capacity", 100.0, positive=True)
        self._idle_power = read_amount(config, "idle_power", 10.0)
        self._power_per_speed = read_amount(config, "power_per_speed", 50.0)
        self._charge_power = read_amount(config, "charge_power", 200.0)
        self._energy = self._capacity
        if self.ros is not None:
            import my_robots.battery_ros  # noqa: F401  (registers the adapter)
        self._reading = self.output("battery", BatteryReading)
        self._recharge = self.command("recharge", bool)

    def after_physics_step(self, timekeeper: Timekeeper) -> None:
        """Updates the energy, and publishes a reading if an update is due."""
        vx, vy, _ = self._body.velocity
        power = -self._idle_power - self._power_per_speed * math.hypot(vx, vy)
        if self._recharge.value:
            power += self._charge_power
        energy = self._energy + power * timekeeper.step_size / 3600.0
        self._energy = min(max(energy, 0.0), self._capacity)
        if self._timer.check_update(timekeeper) and self._reading.wanted:
            self._reading.emit(
                BatteryReading(
                    timekeeper.sim_time_ns, self._voltage, self._capacity, self._energy, power
                )
            )


def read_amount(config: YamlReader, key: str, default: float, *, positive: bool = False) -> float:
    """Reads a finite number of at least 0, or above 0 if `positive` is set."""
    amount: float = config.get(key, "float", default)
    if not math.isfinite(amount) or amount < 0 or (positive and amount == 0):
        expected = "above 0" if positive else "at least 0"
        raise config.error(f'Invalid "{key}", must be finite and {expected}, got {amount}')
    return amount
