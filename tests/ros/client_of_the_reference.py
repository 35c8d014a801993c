"""A node that is written for the reference: uses all of its services and messages.

    client_of_the_reference.py MODEL_FILE

The room of the simulator has a wall at x = 5 m. Prints a line for each result.
"""

import sys
import threading

import rospy
from flatland_msgs.msg import Collision, Collisions, DebugTopicList, Vector2
from flatland_msgs.srv import (
    DeleteModel,
    DeleteModelRequest,
    MoveModel,
    MoveModelRequest,
    SpawnModel,
    SpawnModelRequest,
)
from geometry_msgs.msg import Pose2D

TIMEOUT = 60.0  # s, for each result
_changed = threading.Condition()
_received = {}


def listen(topic, message_type):
    """Keeps all messages of a topic."""
    messages = _received[message_type] = []

    def keep(message):
        with _changed:
            messages.append(message)
            _changed.notify_all()

    rospy.Subscriber(topic, message_type, keep)


def expect(result, message_type, condition, ever=False):
    """Waits until the latest message, or any message since the start, meets a condition."""
    messages = _received[message_type]
    with _changed:
        met = _changed.wait_for(
            lambda: any(map(condition, messages if ever else messages[-1:])), TIMEOUT
        )
    print(result if met else f"missing: {result}", flush=True)


def is_collision(message):
    """Returns whether the crate touches the wall, with points of the contact."""
    if not message.collisions or not message.collisions[0].contact_positions:
        return False
    collision = message.collisions[0]
    assert isinstance(collision, Collision)
    return (
        (collision.entity_A, collision.body_A, collision.entity_B) == ("crate", "box", "2d")
        and isinstance(collision.contact_positions[0], Vector2)
        and collision.contact_positions[0].x > 4
    )


def main():
    """Runs the node."""
    rospy.init_node("client_of_the_reference", disable_rostime=True)
    listen("flatland_server/debug/topics", DebugTopicList)
    listen("crate/collisions", Collisions)
    for name in ("spawn_model", "move_model", "delete_model"):
        rospy.wait_for_service(name, TIMEOUT)
    spawn = rospy.ServiceProxy("spawn_model", SpawnModel)
    request = SpawnModelRequest()
    request.yaml_path = sys.argv[1]
    request.name = request.ns = "crate"
    response = spawn(request)
    print("spawned" if response.success else response.message, flush=True)
    expect("listed", DebugTopicList, lambda message: "model/crate" in message.topics)
    expect("publishes", Collisions, lambda message: not message.collisions)
    move = rospy.ServiceProxy("move_model", MoveModel)
    assert move(MoveModelRequest(name="crate", pose=Pose2D(5.0, 0.0, 0.0))).success
    # A contact has points until the crate sleeps, half a second later.
    expect("collides with the wall", Collisions, is_collision, ever=True)
    assert move(MoveModelRequest(name="crate", pose=Pose2D(0.0, 0.0, 0.0))).success
    expect("is free", Collisions, lambda message: not message.collisions)
    delete = rospy.ServiceProxy("delete_model", DeleteModel)
    assert delete(DeleteModelRequest(name="crate")).success
    expect("no longer listed", DebugTopicList, lambda message: "model/crate" not in message.topics)


if __name__ == "__main__":
    main()
