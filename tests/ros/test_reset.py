"""`reset_world` of a running node: the state, the time, topics and subscribers."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from nav_msgs.msg import Odometry
from raw_subscriber import RawSubscriber
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from waiting import wait_until

from flatland.srv import ResetWorld

STEP_NS = 5_000_000
NOISY = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: DiffDrive, name: drive, body: base, pub_rate: 50, odom_pose_noise: [0.01, 0.01, 0.01]}
  - {type: Laser, name: laser, body: base, range: 20, update_rate: 10, noise_std_dev: 0.05,
     angle: {min: -1.5, max: 1.5, increment: 0.5}}
  - {type: "test::Talker", name: talker}
"""
TALKER = """
from std_msgs.msg import String

import flatland


class Talker(flatland.ModelPlugin):
    def on_initialize(self, config):
        self.talk = self.ros.advertise("talk", String)
        self.ros.subscribe("listen", String, lambda message: self.talk.publish(message))
"""
KEPT = {
    "publishers": {
        "/first/scan",
        "/first/odometry/filtered",
        "/first/odometry/ground_truth",
        "/first/twist",
        "/first/talk",
        "/clock",
        "/tf",
        "/flatland_server/debug/model/first",
        "/flatland_server/debug/layer/2d",
        "/interactive_model_markers/update",
        "/flatland_server/paused",
    },
    "subscribers": {"/first/cmd_vel", "/first/listen", "/interactive_model_markers/feedback"},
    "services": {"/spawn_model", "/step_world", "/reset_world"},
}


@pytest.fixture(scope="module", autouse=True)
def server(module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world("[{name: first, model: noisy.model.yaml, namespace: first}]", noisy=NOISY)
    module_launcher.add_plugins(world.parent, TALKER, "reset_talker")
    return module_launcher.server(world, lockstep=True, seed=1, show_viz=True)


@pytest.fixture
def raw(ros: Any) -> Iterator[Callable[..., RawSubscriber]]:
    opened = []

    def subscribe(topic: str, message_type: type[Any]) -> RawSubscriber:
        opened.append(RawSubscriber(ros.master, topic, message_type))
        return opened[-1]

    yield subscribe
    for subscriber in opened:
        subscriber.close()


@contextmanager
def watched_master(ros: Any, kept: dict[str, set[str]]) -> Iterator[None]:
    """Polls the registrations of the node all the time, and checks that none is missing."""
    missing: list[str] = []
    polls = [0]
    ended = threading.Event()

    def poll() -> None:
        while not ended.is_set():
            state = ros.master.getSystemState()
            for kind, entries in zip(("publishers", "subscribers", "services"), state, strict=True):
                there = {name for name, nodes in entries if "/flatland_server" in nodes}
                missing.extend(kept[kind] - there)
            polls[0] += 1

    thread = threading.Thread(target=poll)
    thread.start()
    try:
        yield
        wait_until("polls", lambda: polls[0] > 3)
    finally:
        ended.set()
        thread.join()
    assert not missing


def episode(ros: Any, *subscribers: RawSubscriber) -> list[str]:
    """Returns the messages of half a second, without their sequence numbers."""
    for subscriber in subscribers:
        subscriber.received()
    ros.step(0.5)
    texts = []
    for subscriber in subscribers:
        for message in subscriber.received():
            if hasattr(message, "header"):
                message.header.seq = 0
            texts.append(str(message))
    return texts


def test_the_same_messages_result_after_a_reset(ros: Any, raw: Any) -> None:
    subscribers = [
        raw("/first/scan", LaserScan),
        raw("/first/odometry/filtered", Odometry),
        raw("/tf", TFMessage),
        raw("/clock", Clock),
    ]
    ros.wait_until_ready("/first/scan", "/first/odometry/filtered", "/tf", "/clock")
    subscribers[-1].next()  # A new subscriber receives the current time.
    runs = []
    for seed in (-1, 2**63 - 1, -1, 1):
        assert ros.call("/reset_world", ResetWorld, False, seed).success
        runs.append(episode(ros, *subscribers))
    assert len(runs[0]) > 100
    assert runs[1] != runs[0]
    assert runs[2] == runs[1]
    assert runs[3] == runs[0]


def test_time_starts_at_0_again_or_continues(ros: Any) -> None:
    clock = ros.ready_topic("/clock", Clock)
    clock.next()  # A new subscriber receives the current time.
    ros.reset()
    assert ros.step() == STEP_NS
    clock.until(lambda message: message.clock.to_nsec() == STEP_NS)
    ros.step(0.1)
    ros.reset()
    times = [message.clock.to_nsec() for message in clock.take(21)]
    assert times == [*(number * STEP_NS for number in range(2, 22)), 1]  # never 0, which is no time
    assert ros.step(0.1) == 20 * STEP_NS
    assert ros.call("/reset_world", ResetWorld, True, -1).success
    assert ros.step() == 21 * STEP_NS


def test_topics_do_not_flicker_and_subscribers_stay_connected(ros: Any, raw: Any) -> None:
    scans, talk = raw("/first/scan", LaserScan), ros.topic("/first/talk", String)
    raw_talk = raw("/first/talk", String)
    listen = ros.publisher("/first/listen", String)
    ros.wait_until_ready("/first/scan", "/first/talk", "/first/listen")
    connections = talk._subscriber.impl.connections[:]
    with watched_master(ros, KEPT):
        for _ in range(10):
            ros.reset()
            scans.received()
            ros.step(0.1)
            # A new connection would be received neither here nor by `raw_talk`.
            assert len(scans.received()) == 1
    assert talk._subscriber.impl.connections == connections
    assert listen.get_num_connections() == 1
    listen.publish(String("still connected"))
    assert talk.next().data == "still connected"
    assert raw_talk.next().data == "still connected"
