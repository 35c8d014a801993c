"""`Imu` as `sensor_msgs/Imu`."""

from geometry_msgs.msg import Vector3
from sensor_msgs.msg import Imu as ImuMessage

from flatland.ros.adapters import convert, register_adapter
from flatland.values import Imu


def to_message(value: Imu) -> ImuMessage:
    """Converts a value to a message."""
    return ImuMessage(
        convert.header(value.stamp, value.frame_id),
        convert.quaternion(value.yaw),
        convert.covariance(value.orientation_covariance),
        Vector3(0.0, 0.0, value.yaw_rate),
        convert.covariance(value.angular_velocity_covariance),
        Vector3(*value.linear_acceleration, 0.0),
        convert.covariance(value.linear_acceleration_covariance),
    )


register_adapter(Imu, ImuMessage, to_message)
