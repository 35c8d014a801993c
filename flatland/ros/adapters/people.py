"""`People` as `geometry_msgs/PoseArray`."""

from geometry_msgs.msg import PoseArray

from flatland.ros.adapters import convert, register_adapter
from flatland.values import People


def to_message(value: People) -> PoseArray:
    """Converts a value to a message."""
    poses = [convert.pose(x, y, yaw) for x, y, yaw in value.poses.tolist()]
    return PoseArray(convert.header(value.stamp, value.frame_id), poses)


register_adapter(People, PoseArray, to_message)
