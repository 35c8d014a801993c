"""The example plugin Battery: discharging, charging, rates, and invalid parameters."""

from __future__ import annotations

import importlib

import pytest

from flatland import PluginError


def robot(parameters):
    """Returns a model that consists of a disc with a battery."""
    return f"""
bodies: [{{name: base, footprints: [{{type: circle, radius: 0.2, density: 1}}]}}]
plugins:
  - {{name: b, type: "my_robots::Battery", {parameters}}}
"""


def battery(load, parameters):
    world = load(robot=robot(parameters))
    return world, world.output("/battery")


def test_battery_is_discharged_by_idle_power_and_speed(load):
    world, output = battery(load, "capacity: 2, idle_power: 36, power_per_speed: 100")
    body = world.model("robot").body("base")
    world.step(200)
    assert output.latest.energy == pytest.approx(2 - 36 / 3600)
    assert output.latest.power == -36
    body.set_velocity(0.3, -0.4, 2)
    world.step(200)
    assert output.latest.energy == pytest.approx(2 - (36 + 36 + 50) / 3600, abs=1e-5)
    assert output.latest.power == pytest.approx(-86)


def test_battery_charges_while_the_command_is_true(load):
    world, output = battery(load, "capacity: 1, idle_power: 360, charge_power: 720")
    recharge = world.command("/recharge")
    world.step(1000)
    assert output.latest.fraction == pytest.approx(0.5)
    recharge.set(True)
    world.step(200)
    assert (output.latest.fraction, output.latest.power) == (pytest.approx(0.6), 360)
    world.step(2000)
    assert output.latest.fraction == 1
    recharge.set(False)
    world.step(200)
    assert output.latest.fraction == pytest.approx(0.9)
    world.step(4000)
    assert output.latest.energy == 0


def test_battery_publishes_at_its_rate(load):
    world = load(robot=robot("update_rate: 4, voltage: 12"))
    output = world.ports.outputs["/battery"]
    world.step(400)
    assert output.latest is None, "computed without subscribers"
    readings = []
    output.subscribe(readings.append)
    world.step(400)
    assert [reading.stamp for reading in readings] == [
        round(seconds * 1e9) for seconds in (2.25, 2.5, 2.75, 3.0, 3.25, 3.5, 3.75, 4.0)
    ]
    assert readings[0].voltage == 12
    assert readings[0].capacity == 100


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ("capacity: 0", 'Invalid "capacity", must be finite and above 0, got 0.0'),
        ("voltage: -1", 'Invalid "voltage", must be finite and above 0, got -1.0'),
        ("voltage: .inf", 'Invalid "voltage", must be finite and above 0, got inf'),
        ("idle_power: -1", 'Invalid "idle_power", must be finite and at least 0, got -1.0'),
        ("power_per_speed: .nan", 'Invalid "power_per_speed", must be finite and at least 0, got'),
        ("charge_power: .inf", 'Invalid "charge_power", must be finite and at least 0, got inf'),
        ("update_rate: -1", 'Invalid "update_rate"'),
        ("body: wheel", 'Body with name "wheel" does not exist'),
        ("capcity: 3", 'contains unrecognized entry(s) {"capcity"}'),
    ],
)
def test_battery_rejects_invalid_parameters(load, parameters, text):
    with pytest.raises(PluginError) as caught:
        battery(load, parameters)
    message = str(caught.value)
    assert message.startswith(
        'Flatland plugin: Model Plugin "b" type "my_robots::Battery" model "robot": '
    )
    assert text in message
    assert "robot.yaml:" in message


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # in modules of ROS
@pytest.mark.parametrize(
    ("energy", "power", "status"),
    [
        (2.0, -10.0, "DISCHARGING"),
        (1.0, 5.0, "CHARGING"),
        (2.0, 5.0, "FULL"),
        (0.0, 0.0, "CHARGING"),
    ],
)
def test_battery_state_contains_the_direction_of_the_current(load, energy, power, status):
    pytest.importorskip("sensor_msgs.msg", reason="ROS is not installed")
    battery(load, "capacity: 2")  # adds the package to the Python path
    adapter = importlib.import_module("my_robots.battery_ros")
    reading = importlib.import_module("my_robots.battery").BatteryReading
    message = adapter.to_message(reading(3_250_000_000, 20.0, 2.0, energy, power))
    assert message.power_supply_status == getattr(message, f"POWER_SUPPLY_STATUS_{status}")
    assert (message.header.stamp.secs, message.header.stamp.nsecs) == (3, 250_000_000)
    assert (message.voltage, message.current) == (20.0, power / 20)
    assert (message.charge, message.capacity, message.percentage) == (energy / 20, 0.1, energy / 2)
