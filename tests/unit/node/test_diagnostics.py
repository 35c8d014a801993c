"""The measurements of /diagnostics, which must not interfere with those of the loop."""

from __future__ import annotations

import threading
from functools import partial
from typing import Any

import pytest
from waiting import TIMEOUT

from flatland.node.diagnostics import DiagnosticsTopic, _Costs, _Drops, _Rate
from flatland.node.values import Level, Status
from flatland.runtime.plugin_costs import PluginCosts
from flatland.simulation import CycleStatistics, Simulation

WORLD = "{properties: {}, layers: [{name: 2d}], models: [{name: r, model: robot.model.yaml}]}"
ROBOT = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins: [{type: DiffDrive, name: drive, body: base}]
"""
DRIVE = 'Model Plugin "drive" type "DiffDrive" model "r" [%]'


@pytest.fixture
def world(files: Any) -> Any:
    files.write("robot.model.yaml", ROBOT)
    return files.load(WORLD)


def keys(costs: _Costs) -> list[str]:
    return list(costs.status().values)


def test_levels_have_the_numbers_of_the_message() -> None:
    assert {level.name: level.value for level in Level} == {"OK": 0, "WARN": 1, "ERROR": 2}


def test_the_rate_in_lockstep_is_not_judged(world: Any) -> None:
    status = _Rate(Simulation(world, lockstep=True)).status(1.0)
    assert status.level == Level.OK
    assert status.text.startswith("lockstep: ")
    assert status.values["update rate [Hz]"] == "on request"
    assert "target real-time factor" not in status.values


def test_costs_of_the_measured_time_are_reported(world: Any) -> None:
    costs = _Costs(world)
    assert costs.status().text == "no data"
    costs.begin(0.0)
    world.step()
    costs.end(0.2)
    world.step()
    assert keys(costs) == [DRIVE, "all of type DiffDrive [%]"]
    assert world.plugin_host.costs is None


def test_a_measurement_of_the_loop_is_not_replaced(world: Any) -> None:
    costs, of_loop = _Costs(world), PluginCosts()
    world.plugin_host.costs = of_loop
    costs.begin(0.0)
    world.step()
    costs.end(0.2)
    assert world.plugin_host.costs is of_loop
    assert of_loop.seconds
    assert keys(costs) == []


def test_nothing_is_measured_while_paused(world: Any) -> None:
    costs = _Costs(world)
    world.pause()
    costs.begin(0.0)
    assert world.plugin_host.costs is None


@pytest.mark.parametrize("reason", ["replaced by the loop", "paused", "reset"])
def test_a_measurement_is_discarded(world: Any, reason: str) -> None:
    costs, of_loop = _Costs(world), PluginCosts()
    costs.begin(0.0)
    world.step()
    if reason == "replaced by the loop":
        world.plugin_host.costs = of_loop
    elif reason == "paused":
        world.pause()
    else:
        costs.reset()
    costs.end(0.2)
    assert world.plugin_host.costs is (of_loop if reason == "replaced by the loop" else None)
    assert keys(costs) == []


def test_costs_are_shares_of_the_wall_time(
    world: Any, fake_time: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    measurement = partial(PluginCosts, fake_time.clock)
    monkeypatch.setattr("flatland.node.diagnostics.PluginCosts", measurement)
    costs = _Costs(world)
    (plugin,) = world.model("r").plugins
    for seconds in (0.02, 0.06):
        costs.begin(0.0)
        world.plugin_host.costs.timed(plugin, fake_time.spend)(seconds)
        costs.end(0.2)
    status = costs.status()
    assert status.values == {DRIVE: "20.00", "all of type DiffDrive [%]": "20.00"}
    assert status.text == "20.0 % of the wall time"


@pytest.mark.parametrize(
    ("lost", "level", "text"),
    [
        (0.0, Level.OK, "50.0 steps per second"),
        (0.01, Level.OK, "50.0 steps per second"),
        (0.03, Level.WARN, "the update rate of 100 Hz cannot be held: 50.0 steps per second"),
    ],
)
def test_the_rate_since_the_previous_message(
    world: Any, lost: float, level: Level, text: str
) -> None:
    simulation = Simulation(world, 100.0)
    rate = _Rate(simulation)
    rate.status(1.0)
    for _ in range(50):
        world.step()
    simulation.lost_time = lost
    status = rate.status(2.0)
    assert (status.level, status.text) == (level, text)
    expected = {
        "steps per second": "50.0",
        "update rate [Hz]": "100",
        "real-time factor": "0.250",
        "target real-time factor": "0.5",
        "lost time [s]": f"{lost:.3f}",
        "simulated time [s]": "0.250",
        "paused": "False",
        "models": "1",
    }
    assert status.values == expected


def test_the_use_of_cycles_is_reported_if_they_have_a_length(world: Any) -> None:
    simulation = Simulation(world, 100.0)
    simulation.statistics = CycleStatistics(7, 10.0, 30.0, 20.0, 0.5, 0.5)
    values = _Rate(simulation).status(1.0).values
    assert values["mean use of a cycle [%]"] == "20.0"
    assert values["maximum use of a cycle [%]"] == "30.0"
    simulation.set_rate(0.0)
    assert "mean use of a cycle [%]" not in _Rate(simulation).status(1.0).values


def test_the_rate_while_paused_and_without_a_limit(world: Any) -> None:
    simulation = Simulation(world, 0.0)
    world.pause()
    status = _Rate(simulation).status(1.0)
    assert status.text == "paused"
    assert status.values["paused"] == "True"
    assert status.values["update rate [Hz]"] == "inf"
    assert status.values["target real-time factor"] == "inf"


def test_the_rate_starts_again_with_a_reset(world: Any) -> None:
    rate = _Rate(Simulation(world, 100.0))
    rate.status(10.0)
    world.step(50)
    rate.status(10.5)
    world.reset(seed=1)
    world.step(2)
    assert rate.status(10.6).text == "20.0 steps per second"


def test_subscribers_that_do_not_keep_up_are_named(transport: Any) -> None:
    drops = _Drops(transport)
    transport.lost.update({("/scan", "/rviz"): 3, ("/clock", "/rviz"): 4})
    status = drops.status()
    assert (status.level, status.text) == (
        Level.WARN,
        "subscribers do not keep up: /scan to /rviz",
    )
    assert status.values["/scan to /rviz"] == "3 messages dropped"
    assert (drops.status().level, drops.status().text) == (Level.OK, "all keep up")


def test_disabled_plugins_are_an_error(world: Any) -> None:
    (plugin,) = world.model("r").plugins
    costs = _Costs(world)
    costs._measured.append((0.5, {("DiffDrive", DRIVE.removesuffix(" [%]")): 0.1}))
    world.plugin_host.disabled.add(plugin)
    name = DRIVE.removesuffix(" [%]")
    assert costs.status() == Status(
        "plugins",
        Level.ERROR,
        f"1 disabled after errors: {name}",
        {DRIVE: "20.00", "all of type DiffDrive [%]": "20.00", "disabled": name},
    )


def test_the_largest_costs_are_listed_first(world: Any) -> None:
    costs = _Costs(world)
    shares = {(f"T{number % 30}", f"p{number}"): 0.001 * (number % 30 + 1) for number in range(30)}
    for _ in range(11):  # of which ten count
        costs._measured.append((0.5, shares))
    costs._measured.append((1.0, {}))
    status = costs.status()
    order = list(range(29, 9, -1))
    elapsed = 9 * 0.5 + 1.0
    expected = [f"{100 * 9 * 0.001 * (number + 1) / elapsed:.2f}" for number in order]
    assert list(status.values) == [
        *(f"p{number} [%]" for number in order),
        *(f"all of type T{number} [%]" for number in order),
    ]
    assert list(status.values.values()) == expected * 2
    assert status.text == f"{100 * 9 * 0.001 * 465 / elapsed:.1f} % of the wall time"
    assert (status.name, status.level) == ("plugins", Level.OK)


def test_a_message_has_the_statuses_of_the_node(
    world: Any, transport: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr("flatland.node.diagnostics.time.perf_counter", lambda: now[0])
    diagnostics = DiagnosticsTopic(transport, Simulation(world, 100.0))
    topic = transport.topics["/diagnostics"]
    sent = []
    try:
        assert not diagnostics._tick(0.0)
        assert world.plugin_host.costs is None
        topic.connected = True
        assert diagnostics._ticker.period == 0.2
        for tick in range(11):
            assert diagnostics._tick(0.0)
            sent.append(len(topic.sent))
            # Costs are measured from the tick of a message to the next one.
            assert (world.plugin_host.costs is not None) is (tick % 5 == 0)
            world.step(8)
            now[0] += 0.2
        elapsed = [seconds for seconds, _ in diagnostics._costs._measured]
        assert elapsed == pytest.approx([0.2] * 2)
    finally:
        diagnostics.close()
    assert world.plugin_host.costs is None
    assert sent == [0] * 5 + [1] * 5 + [2]
    for message in topic.sent:
        assert [(status.name, status.level) for status in message] == [
            ("flatland_server: simulation", Level.OK),
            ("flatland_server: plugins", Level.OK),
            ("flatland_server: subscribers", Level.OK),
        ]
        assert message[0].text == "40.0 steps per second"
        assert message[2].text == "all keep up"
    # A subscriber that comes back receives nothing about the time without one.
    topic.connected = False
    assert not diagnostics._tick(0.0)
    assert diagnostics._ticks == 0
    assert list(diagnostics._costs._measured) == []


def test_a_subscriber_wakes_the_topic(world: Any, transport: Any) -> None:
    posted = threading.Event()
    simulation = Simulation(world)
    simulation.post = lambda _action: posted.set()  # type: ignore[method-assign,assignment]
    diagnostics = DiagnosticsTopic(transport, simulation)
    topic = transport.topics["/diagnostics"]
    assert not posted.is_set()
    topic.connected = True
    topic._on_connection(True)
    assert posted.wait(TIMEOUT)
    diagnostics.close()
    assert diagnostics._ticker.closed


def test_lost_time_counts_from_the_previous_message(world: Any) -> None:
    simulation = Simulation(world, 100.0)
    rate = _Rate(simulation)
    simulation.lost_time = 0.6
    assert rate.status(1.0).values["lost time [s]"] == "0.600"
    simulation.lost_time = 0.7
    # One per cent of the time may be lost.
    status = rate.status(11.0)
    assert status.values["lost time [s]"] == "0.100"
    assert status.level is Level.OK
    simulation.lost_time = 0.81
    assert rate.status(21.0).level is Level.WARN


def test_a_world_that_stands_still_has_no_steps(world: Any) -> None:
    rate = _Rate(Simulation(world, 100.0))
    world.step(50)
    rate.status(1.0)
    assert rate.status(2.0).text == "0.0 steps per second"
    world.step(100)
    values = rate.status(4.0).values
    assert (values["steps per second"], values["real-time factor"]) == ("50.0", "0.250")
