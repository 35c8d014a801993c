"""The topics with the state of a world, without ROS."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from waiting import wait_until

from flatland.errors import WorldError
from flatland.node.states import PAUSED_RATE, PauseTopic, stamped_states

WORLD = """
properties: {}
layers: [{name: 2d}]
models: [{name: a, namespace: n, model: ball.model.yaml, pose: [1, 2, 0]}]
"""
BALL = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]"


@pytest.fixture
def node(serve: Any, files: Any) -> Any:
    files.write("ball.model.yaml", BALL)
    return serve(WORLD, lockstep=True, model_states_rate=50)


def test_the_pause_state_is_published_when_it_changes(node: Any) -> None:
    topic = wait_until("the topic", lambda: node.transport.topics.get("~paused"))
    topic.connect()
    wait_until("the first state", lambda: topic.sent)
    node.run(node.world.pause)
    wait_until("the pause", lambda: topic.sent[-1:] == [True])
    node.run(node.world.resume)
    wait_until("the end of the pause", lambda: topic.sent[-1:] == [False])
    assert set(topic.sent) == {True, False}


def test_the_states_of_models_are_published_at_a_rate_and_at_changes(node: Any) -> None:
    topic = node.transport.topics["model_states"]
    topic.connect()
    node.run(lambda: None)  # after the request that observes the world
    assert [list(states.names) for states in topic.sent] == [["a"]]
    node.served.simulation.request_steps(8).result(10)  # 40 ms
    assert [states.stamp for states in topic.sent[1:]] == [20_000_000, 40_000_000]
    count = len(topic.sent)
    node.run(lambda: [node.world.spawn_model("ball.model.yaml", name) for name in "bc"])
    node.run(lambda: None)
    assert [list(states.names) for states in topic.sent[count:]] == [["a", "b", "c"]]
    node.run(lambda: node.world.move_model("b", (3.0, 0.0, 0.0)))
    node.run(lambda: None)
    last = topic.sent[-1]
    assert last.frame_id == "map"
    assert list(last.namespaces) == ["n", "", ""]
    assert last.poses[1].tolist() == [3.0, 0.0, 0.0]
    topic.connected = False
    node.transport.topics["model_states"]._on_connection(False)
    node.run(lambda: None)
    count = len(topic.sent)
    topic.connected = True
    node.served.simulation.request_steps(8).result(10)
    assert len(topic.sent) == count


def test_the_states_of_some_models_are_in_the_order_of_their_names(files: Any) -> None:
    files.write("ball.model.yaml", BALL)
    world = files.load(WORLD)
    for number, name in enumerate("bcd", 1):
        world.spawn_model("ball.model.yaml", name, f"n{name}", (number, 5.0, 0.5))
        world.model(name).bodies[0].set_velocity(0.5, 0.0, float(number))
    world.step()
    states = stamped_states(world, ["d", "b"])
    assert (states.stamp, states.frame_id) == (5_000_000, "map")
    assert list(states.names) == ["d", "b"]
    assert list(states.namespaces) == ["nd", "nb"]
    everything = stamped_states(world)
    assert list(everything.names) == ["a", "b", "c", "d"]
    assert states.poses.tolist() == everything.poses[[3, 1]].tolist()
    assert states.velocities.tolist() == everything.velocities[[3, 1]].tolist()
    assert states.velocities[:, 2].tolist() == pytest.approx([3.0, 1.0], rel=0.1)
    assert states.poses.shape == states.velocities.shape == (2, 3)
    with pytest.raises(WorldError, match='model with name "e" does not exist'):
        stamped_states(world, ["e"])


def test_the_pause_state_is_sent_once_for_each_change(files: Any, transport: Any) -> None:
    world = files.load("{properties: {}, layers: [{name: 2d}]}")
    posted: list[Any] = []
    simulation: Any = SimpleNamespace(world=world, post=posted.append)
    states = PauseTopic(transport, simulation)
    topic = transport.topics["~paused"]
    assert states._ticker.period == 1.0 / PAUSED_RATE
    assert not states._tick(0.0)  # without subscribers
    topic.connected = True
    assert topic._post == posted.append
    for _ in range(2):
        assert states._tick(0.0)
    assert topic.sent == []
    world.pause()
    for _ in range(2):
        states._tick(0.0)
    assert topic.sent == [True]
    # A new subscriber receives a change that the others have not yet received.
    world.resume()
    assert topic._make() is False
    states._tick(0.0)
    assert topic.sent == [True, False]
    assert topic._make() is False
    states._tick(0.0)
    assert topic.sent == [True, False]
    states.close()
    assert states._ticker.closed
