"""`AckermannCommand` as `ackermann_msgs/AckermannDriveStamped`, which is not always installed."""

from ackermann_msgs.msg import AckermannDriveStamped  # type: ignore[import-not-found]

from flatland.ros.adapters import register_built_in
from flatland.values import AckermannCommand


def from_message(message: AckermannDriveStamped) -> AckermannCommand:
    """Converts a message to a value, discarding the stamp and the limit of the jerk."""
    drive = message.drive
    return AckermannCommand(
        drive.steering_angle, drive.steering_angle_velocity, drive.speed, drive.acceleration
    )


register_built_in(AckermannCommand, AckermannDriveStamped, from_message=from_message)
