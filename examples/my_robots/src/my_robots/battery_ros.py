"""Converts `BatteryReading` to `sensor_msgs/BatteryState`; imported only with ROS."""

import math

from sensor_msgs.msg import BatteryState

from flatland.ros.adapters import convert, register_adapter
from my_robots.battery import BatteryReading


def to_message(reading: BatteryReading) -> BatteryState:
    """Converts a reading to a message."""
    message = BatteryState()
    message.header.stamp = convert.time(reading.stamp)
    message.voltage = reading.voltage
    message.current = reading.power / reading.voltage
    message.charge = reading.energy / reading.voltage
    message.capacity = message.design_capacity = reading.capacity / reading.voltage
    message.percentage = reading.fraction
    message.temperature = math.nan
    message.present = True
    if reading.power < 0:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    elif reading.fraction < 1:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_CHARGING
    else:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_FULL
    return message


register_adapter(BatteryReading, BatteryState, to_message)
