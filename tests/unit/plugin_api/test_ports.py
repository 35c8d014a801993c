"""Topic names, outputs and commands."""

from __future__ import annotations

import pytest

from flatland import FlatlandError, Twist, WorldError
from flatland.graph_names import is_legal_namespace, resolve_topic
from flatland.plugin_api.port_registry import PortRegistry


@pytest.mark.parametrize(
    ("topic", "namespace", "expected"),
    [
        ("scan", "", "scan"),
        ("scan", "r1", "r1/scan"),
        ("scan", "r1/", "r1/scan"),
        ("scan", "/r1", "/r1/scan"),
        ("/scan", "r1", "/scan"),
        ("a/2d", "r1/b", "r1/b/a/2d"),
        ("cmd_vel/", "", "cmd_vel"),
        ("a//b", "r1", "r1/a/b"),
        ("//a///b//", "r1", "/a/b"),
        ("a", "//r1///b//", "/r1/b/a"),
        ("a", "/", "a"),
    ],
)
def test_topics_take_the_namespace(topic, namespace, expected):
    assert resolve_topic(topic, namespace) == expected


@pytest.mark.parametrize("topic", ["", "my robot", "1st", "a-b", "/", "//", "~x", "é", "_a", "a /"])
def test_illegal_topics(topic):
    with pytest.raises(ValueError, match="is not a legal topic name"):
        resolve_topic(topic)


@pytest.mark.parametrize(
    ("namespace", "legal"),
    [("", True), ("/", True), ("r1", True), ("/r1/", True), ("a/b_2", True), ("a b", False),
     ("a-b", False), ("2", False), ("a//b", True), ("//", True), ("a//b c/", False)],
)  # fmt: skip
def test_namespaces(namespace, legal):
    assert is_legal_namespace(namespace) is legal


def test_output_is_wanted_while_someone_listens():
    output = PortRegistry().open_output("r1/x", int)
    assert output.topic == "/r1/x"
    assert not output.wanted
    got = []
    unsubscribe = output.subscribe(got.append)
    output.want("bridge")
    assert output.wanted
    output.emit(1)
    unsubscribe()
    output.emit(2)
    assert (got, output.latest) == ([1], 2)
    assert output.wanted
    output.unwant("bridge")
    assert not output.wanted


def test_a_listener_that_does_not_want():
    output = PortRegistry().open_output("x", int)
    output.subscribe(print, wants=False)
    assert not output.wanted


def test_outputs_of_one_topic_are_shared_until_the_last_owner_goes():
    ports = PortRegistry()
    opened, closed = [], []
    ports.output_opened.append(opened.append)
    ports.output_closed.append(closed.append)
    first, second = ports.open_output("x", int), ports.open_output("/x", int)
    assert first is second
    assert opened == [first]
    ports.close_output(first)
    assert closed == []
    assert ports.find_output("x") is first
    ports.close_output(second)
    ports.close_output(second)
    assert closed == [first]
    assert first.closed
    with pytest.raises(WorldError, match=r'no output "x", there are: none'):
        ports.find_output("x")


def test_a_topic_has_one_type():
    ports = PortRegistry()
    ports.open_output("x", int)
    ports.open_command("c", int, 0)
    with pytest.raises(FlatlandError, match='topic "/x" carries int already, not float'):
        ports.open_output("x", float)
    with pytest.raises(FlatlandError, match='topic "/c" carries int already, not bool'):
        ports.open_command("c", bool, False)


def test_a_type_conflict_names_an_owner_that_is_left():
    ports = PortRegistry()
    output = ports.open_output("x", int, "first")
    assert ports.open_output("x", int, "second") is output
    ports.close_output(output, "first")
    with pytest.raises(FlatlandError, match='"/x" carries int already, used by second, not float'):
        ports.open_output("x", float, "third")
    command = ports.open_command("c", int, 0, owner="fourth")
    ports.open_command("c", int, 0, owner="fifth")
    ports.close_command(command)
    with pytest.raises(FlatlandError, match='"/c" carries int already, used by fifth, not bool'):
        ports.open_command("c", bool, False)


def test_topics_are_found_by_any_spelling():
    ports = PortRegistry()
    output = ports.open_output("r1/a/b", int)
    assert ports.find_output("/r1//a/b/") is output
    ports.open_command("r1/c", int, 0)
    assert ports.find_command("r1/c/").topic == "/r1/c"


def test_commands_of_one_topic_are_set_together():
    ports = PortRegistry()
    first = ports.open_command("cmd_vel", Twist, Twist())
    ports.find_command("/cmd_vel").set(Twist(1.0))
    second = ports.open_command("cmd_vel", Twist, Twist())
    # One that comes later knows nothing of what was said before, as a ROS subscriber.
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
        with pytest.raises(WorldError, match="command /cmd_vel is gone with its model"):
            use()


def test_commands_refuse_what_they_do_not_take():
    command = PortRegistry().open_command("c", int, 7, accept=lambda value: value >= 0)
    command.set(-1)
    assert (command.value, command.received) == (7, 0)
    command.set(3)
    assert (command.value, command.received) == (3, 1)
    with pytest.raises(TypeError, match=r"command /c takes int, got 'x'"):
        command.set("x")


def test_an_observer_may_refuse_a_port():
    ports = PortRegistry()

    def refuse(port):
        raise FlatlandError("no")

    ports.output_opened.append(refuse)
    ports.command_opened.append(refuse)
    with pytest.raises(FlatlandError):
        ports.open_output("x", int)
    with pytest.raises(FlatlandError):
        ports.open_command("x", int, 0)
    assert (ports.outputs, ports.commands) == ({}, {})
