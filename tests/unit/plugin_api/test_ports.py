"""Outputs, commands and their registry."""

from __future__ import annotations

import sys
import threading

import pytest

from flatland import FlatlandError, Twist, WorldError
from flatland.plugin_api.port_registry import PortRegistry


class Recorder:
    """Records the notifications of a registry."""

    def __init__(self):
        self.events = []

    def output_opened(self, output):
        self.events.append(("output_opened", output))

    def output_closed(self, output):
        self.events.append(("output_closed", output))

    def command_opened(self, command):
        self.events.append(("command_opened", command))

    def command_closed(self, command):
        self.events.append(("command_closed", command))


def test_output_is_wanted_while_it_has_subscribers():
    output = PortRegistry(Recorder()).open_output("r1/x", int)
    assert output.topic == "/r1/x"
    assert not output.wanted
    received = []
    unsubscribe = output.subscribe(received.append)
    output.want("bridge")
    assert output.wanted
    output.emit(1)
    unsubscribe()
    output.emit(2)
    assert (received, output.latest) == ([1], 2)
    assert output.wanted
    output.unwant("bridge")
    assert not output.wanted
    output.subscribe(print, wants=False)
    assert not output.wanted


def test_an_output_is_shared_until_its_last_owner_closes_it():
    recorder = Recorder()
    ports = PortRegistry(recorder)
    first, second = ports.open_output("x/y", int), ports.open_output("/x/y", int)
    assert first is second
    assert recorder.events == [("output_opened", first)]
    ports.close_output(first)
    assert len(recorder.events) == 1
    assert ports.find_output("/x//y/") is first
    ports.close_output(second)
    ports.close_output(second)
    assert recorder.events[1:] == [("output_closed", first)]
    assert first.closed
    with pytest.raises(WorldError, match=r'output "x/y" does not exist; existing outputs: none'):
        ports.find_output("x/y")


def test_a_topic_has_one_type():
    ports = PortRegistry(Recorder())
    ports.open_output("x", int)
    ports.open_command("c", int, 0)
    with pytest.raises(FlatlandError, match='topic "/x" already carries int, not float'):
        ports.open_output("x", float)
    with pytest.raises(FlatlandError, match='topic "/c" already carries int, not bool'):
        ports.open_command("c", bool, False)


def test_a_type_conflict_names_a_remaining_owner():
    ports = PortRegistry(Recorder())
    output = ports.open_output("x", int, "first")
    assert ports.open_output("x", int, "second") is output
    ports.close_output(output, "first")
    with pytest.raises(FlatlandError, match='"/x" already carries int, used by second, not float'):
        ports.open_output("x", float, "third")
    command = ports.open_command("c", int, 0, owner="fourth")
    ports.open_command("c", int, 0, owner="fifth")
    ports.close_command(command)
    with pytest.raises(FlatlandError, match='"/c" already carries int, used by fifth, not bool'):
        ports.open_command("c", bool, False)


def test_commands_of_one_topic_are_set_together():
    ports = PortRegistry(Recorder())
    first = ports.open_command("cmd_vel", Twist, Twist())
    assert first.topic == "/cmd_vel"
    ports.find_command("cmd_vel/").set(Twist(1.0))
    second = ports.open_command("cmd_vel", Twist, Twist())
    # A command that is opened later does not receive earlier values, like a ROS subscriber.
    assert (first.value.linear_x, second.value.linear_x) == (1.0, 0.0)
    topic = ports.find_command("cmd_vel")
    topic.set(Twist(2.0))
    assert (first.value.linear_x, second.value.linear_x, second.received) == (2.0, 2.0, 1)
    ports.close_command(first)
    topic.set(Twist(3.0))
    assert (first.value.linear_x, second.value.linear_x) == (2.0, 3.0)
    assert topic.value.linear_x == 3.0
    ports.close_command(second)
    ports.close_command(second)
    for use in (lambda: topic.value, lambda: topic.set(Twist())):
        with pytest.raises(WorldError, match="command /cmd_vel was closed with its model"):
            use()


def test_commands_reject_invalid_values_and_types():
    command = PortRegistry(Recorder()).open_command("c", int, 7, accept=lambda value: value >= 0)
    command.set(-1)
    assert (command.value, command.received) == (7, 0)
    command.set(3)
    assert (command.value, command.received) == (3, 1)
    with pytest.raises(TypeError, match=r"command /c takes int, got 'x'"):
        command.set("x")


def test_a_command_is_counted_before_its_change_is_notified():
    registry = PortRegistry(Recorder())
    command = registry.open_command("go", float, 0.0)
    seen = []
    command.on_change = lambda: seen.append((command.state, command.value, command.received))
    command.set(1.0)
    command.value = 2.0
    assert seen == [((1.0, 1), 1.0, 1), ((2.0, 1), 2.0, 1)]


def test_concurrent_values_of_a_command_are_all_counted():
    command = PortRegistry(Recorder()).open_command("go", float, 0.0)
    command.accept = lambda value: True
    states = []

    def set_values():
        for n in range(2000):
            command.set(float(n))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=set_values) for _ in range(4)]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            states.append(command.state)
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert command.received == 8000
    assert command.state == (1999.0, 8000)
    assert [count for _, count in states] == sorted(count for _, count in states)


def test_an_observer_may_reject_a_port():
    class Refusal(Recorder):
        def output_opened(self, output):
            raise FlatlandError("no")

        command_opened = output_opened

    ports = PortRegistry(Refusal())
    with pytest.raises(FlatlandError):
        ports.open_output("x", int)
    with pytest.raises(FlatlandError):
        ports.open_command("x", int, 0)
    assert (ports.outputs, ports.commands) == ({}, {})


def test_a_function_subscribed_twice_has_two_subscriptions():
    output = PortRegistry(Recorder()).open_output("x", int)
    received = []
    first, second = output.subscribe(received.append), output.subscribe(received.append)
    output.emit(1)
    assert received == [1, 1]
    first()
    first()
    output.emit(2)
    assert received == [1, 1, 2]
    assert output.wanted
    second()
    output.emit(3)
    assert received == [1, 1, 2]
    assert not output.wanted


def test_concurrent_updates_of_want_are_not_lost():
    output = PortRegistry(Recorder()).open_output("x", int)
    start = threading.Barrier(4)
    interval = sys.getswitchinterval()

    def toggle(number):
        start.wait()
        for turn in range(1000):
            output.want((number, turn))
            unsubscribe = output.subscribe(print)
            output.unwant((number, turn))
            if turn % 2:
                unsubscribe()

    threads = [threading.Thread(target=toggle, args=(number,)) for number in range(4)]
    try:
        sys.setswitchinterval(1e-6)
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert len(output._subscribers) == len(output._wanters) == 4 * 500


def test_an_exception_of_a_subscriber_does_not_reach_the_plugin():
    faults, received = [], []
    ports = PortRegistry(Recorder(), lambda *fault: faults.append(fault))
    output = ports.open_output("x", int)

    def fail(value):
        raise RuntimeError(f"no use for {value}")

    output.subscribe(fail)
    output.subscribe(received.append)
    output.emit(5)
    assert received == [5]
    [(where, callback, error)] = faults
    assert (where, callback, str(error)) == (output, fail, "no use for 5")
