"""`TrackedPeople` as `people_msgs/People`; imported only where that package is installed."""

import importlib
from typing import Any

from geometry_msgs.msg import Point

from flatland.ros.adapters import convert, register_built_in
from flatland.values import TrackedPeople

_messages: Any = importlib.import_module("people_msgs.msg")


def to_message(value: TrackedPeople) -> Any:
    """Converts a value to a message."""
    people = []
    for name, group, (x, y, _), (vx, vy, _) in zip(
        value.names, value.groups, value.poses.tolist(), value.velocities.tolist(), strict=True
    ):
        person = _messages.Person()
        person.name = name
        person.position, person.velocity = Point(x, y, 0.0), Point(vx, vy, 0.0)
        person.reliability = 1.0
        person.tagnames, person.tags = ["group"], [group]
        people.append(person)
    message = _messages.People()
    message.header = convert.header(value.stamp, value.frame_id)
    message.people = people
    return message


register_built_in(TrackedPeople, _messages.People, to_message=to_message)
