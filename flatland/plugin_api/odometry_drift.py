"""Odometry that drifts: the odometry motion model, integrated over the motion of a body.

The model is that of S. Thrun, W. Burgard and D. Fox, *Probabilistic Robotics*, MIT Press 2005,
table 5.6 (`sample_motion_model_odometry`): a motion that consists of a rotation, a translation d
and a second rotation is measured with independent normal errors, whose variances are

    a1 rot² + a2 d²               of each of the two rotations,
    a3 d² + a4 (rot1² + rot2²)    of the translation.

The variances are quadratic. If the model were applied to each step, the sum of the errors would
depend on the step size and vanish for short steps. It is therefore applied to segments of motion of
a fixed size; the errors of a segment are spread over it in proportion to the motion. The estimate
is thus continuous, its velocity jumps only between segments, and its distribution depends on the
path only. The rotations of a segment are treated as one rotation phi, as the body of a drive moves
along its x axis (rot1 = rot2 = 0 if it moves straight ahead, d = 0 if it turns in place):

    var(phi) = a1 phi² + 2 a2 d²,    var(d) = a3 d² + a4 phi².

The factor 2 stands for the two rotations, which a straight motion has, too. As no direction of a
displacement is computed, motions of any size and backwards are not special.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from flatland.geometry import DoubleArray, Pose, Vector2, compose, invert, rotate
from flatland.plugin_api.noise import NoiseStream

DriftParameters = tuple[float, float, float, float]
"""(a1, a2, a3, a4): [rad²/rad²], [rad²/m²], [m²/m²], [m²/rad²]."""

# The default distances between two updates of amcl, which applies the same model to them.
SEGMENT_LENGTH: Final = 0.2  # m
SEGMENT_ANGLE: Final = math.pi / 6  # rad

_PLANAR: Final = np.ix_((0, 1, 5), (0, 1, 5))  # x, y and yaw of a matrix of shape (6, 6)


class OdometryDrift:
    """The estimate of the pose of a body by odometry with errors that accumulate.

    A segment ends when d / `SEGMENT_LENGTH` + |phi| / `SEGMENT_ANGLE`, summed over its steps, is 1.
    The errors apply to the center of the motion, a point of the body that moves along its x
    axis; the rest of the body follows rigidly. A sideways motion, such as of a body that is
    pushed, is measured exactly and counts as part of the distance.

    Attributes:
        pose: Estimated pose of the origin of the body in the odometry frame [m, rad].
    """

    def __init__(
        self,
        parameters: DriftParameters,
        stream: NoiseStream,
        pose: Pose,
        center: Vector2 = (0.0, 0.0),
    ) -> None:
        """Starts the estimate at the true pose.

        Args:
            parameters: Parameters of the errors, each at least 0.
            stream: Random numbers; one update for each segment.
            pose: Pose of the origin of the body in the world frame [m, rad].
            center: Center of the motion in the frame of the body [m].
        """
        self._a1, self._a2, self._a3, self._a4 = parameters
        self._stream = stream
        self._center = center
        self._true = self._estimate = self._of_center(pose)  # poses of the center
        self.pose = pose
        # Covariance of the estimate of the center: xx, xy, x yaw, yy, y yaw, yaw yaw.
        self._covariance = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._progress = 0.0  # share of the current segment
        self._distance_error = self._angle_error = 0.0  # in standard deviations
        self._draw()

    def _of_center(self, pose: Pose) -> Pose:
        return compose(pose, (*self._center, 0.0))

    def _draw(self) -> None:
        self._stream.begin_update()
        self._distance_error, self._angle_error = self._stream.rng.standard_normal(2).tolist()

    def _variances(self, distance: float, angle: float) -> tuple[float, float]:
        """Returns the variances of a distance [m] and an angle [rad], or of both velocities."""
        d2, phi2 = distance * distance, angle * angle
        return self._a3 * d2 + self._a4 * phi2, self._a1 * phi2 + 2.0 * self._a2 * d2

    def advance(self, pose: Pose) -> None:
        """Integrates a motion; to be called after each step.

        Args:
            pose: Pose of the origin of the body in the world frame [m, rad]. One that is not finite
                is ignored.
        """
        true = self._of_center(pose)
        if true == self._true or not all(map(math.isfinite, true)):
            return
        angle = true[2] - self._true[2]
        # The chord of an arc has the mean of the headings at its ends.
        forward, sideways = rotate(
            (true[0] - self._true[0], true[1] - self._true[1]), -self._true[2] - angle / 2
        )
        self._true = true
        distance = math.hypot(forward, sideways)
        progress = distance / SEGMENT_LENGTH + abs(angle) / SEGMENT_ANGLE
        distance_variance, angle_variance = self._variances(distance, angle)
        forward += self._distance_error * math.sqrt(distance_variance)
        angle += self._angle_error * math.sqrt(angle_variance)
        x, y, yaw = self._estimate
        heading = yaw + angle / 2
        dx, dy = rotate((forward, sideways), heading)
        self._estimate = (x + dx, y + dy, yaw + angle)
        self.pose = self._of_origin()
        xx, xy, xt, yy, yt, tt = _shifted(self._covariance, dx, dy)
        # The variance of a segment, in proportion to the motion.
        along = distance_variance / progress
        c, s = math.cos(heading), math.sin(heading)
        self._covariance = (
            xx + along * c * c,
            xy + along * c * s,
            xt,
            yy + along * s * s,
            yt,
            tt + angle_variance / progress,
        )
        self._progress += progress
        if self._progress >= 1.0:
            self._progress %= 1.0
            self._draw()

    def _of_origin(self) -> Pose:
        return compose(self._estimate, (-self._center[0], -self._center[1], 0.0))

    def move(self, previous: Pose, pose: Pose, keep: bool) -> None:
        """Applies a displacement that is not a motion, such as by `World.move_model`.

        Args:
            previous: Pose of the origin of the body before it, in the world frame [m, rad].
            pose: Pose of the origin of the body after it.
            keep: Whether the estimate remains; otherwise it is displaced as the body, so that the
                transform from the world frame to the odometry frame does not change.
        """
        self.advance(previous)
        true = self._of_center(pose)
        if not keep:
            x, y, _ = self._estimate
            self._estimate = compose(compose(self._estimate, invert(self._true)), true)
            dx, dy = self._estimate[0] - x, self._estimate[1] - y
            self._covariance = _shifted(self._covariance, dx, dy)
            self.pose = self._of_origin()
        self._true = true

    def state(self) -> object:
        """Returns everything that changes, for `FlatlandPlugin.state`."""
        errors = (self._progress, self._distance_error, self._angle_error)
        return (self._true, self._estimate, self._covariance, errors)

    def measure(self, velocity: Pose) -> Pose:
        """Returns the velocity of the estimate for a true velocity.

        Args:
            velocity: (vx, vy, omega) of the origin of the body in its frame [m/s, rad/s].
        """
        forward, sideways, omega = self._velocity_of_center(velocity)
        distance_variance, angle_variance = self._variances(math.hypot(forward, sideways), omega)
        forward += self._distance_error * math.sqrt(distance_variance)
        omega += self._angle_error * math.sqrt(angle_variance)
        cx, cy = self._center
        return (forward + omega * cy, sideways - omega * cx, omega)

    def _velocity_of_center(self, velocity: Pose) -> Pose:
        vx, vy, omega = velocity
        cx, cy = self._center
        return (vx - omega * cy, vy + omega * cx, omega)

    def pose_covariance(self) -> DoubleArray:
        """Returns the covariance of `pose` to first order, shape (6, 6), odometry frame."""
        offset_x, offset_y = self.pose[0] - self._estimate[0], self.pose[1] - self._estimate[1]
        xx, xy, xt, yy, yt, tt = _shifted(self._covariance, offset_x, offset_y)
        matrix = np.zeros((6, 6))
        matrix[_PLANAR] = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]
        return matrix

    def twist_covariance(self, velocity: Pose, yaw: float = 0.0) -> DoubleArray:
        """Returns the covariance of a measured velocity, shape (6, 6).

        Args:
            velocity: The true velocity as for `measure`.
            yaw: Heading of the body in the frame of the result, 0 for the frame of the body [rad].
        """
        forward, sideways, omega = self._velocity_of_center(velocity)
        variances = self._variances(math.hypot(forward, sideways), omega)
        cx, cy = self._center
        # Derivatives of the velocity of the origin: by the velocity of the center, by the yaw rate.
        by_forward = (*rotate((1.0, 0.0), yaw), 0.0)
        by_omega = (*rotate((cy, -cx), yaw), 1.0)
        jacobian = np.array([by_forward, by_omega]).T
        matrix = np.zeros((6, 6))
        matrix[_PLANAR] = jacobian * variances @ jacobian.T
        return matrix


def _shifted(
    covariance: tuple[float, float, float, float, float, float], dx: float, dy: float
) -> tuple[float, float, float, float, float, float]:
    """Returns the covariance of a pose at a fixed offset (dx, dy) from another pose.

    The error of the yaw rotates the offset; see *Probabilistic Robotics*, table 7.2, line 8.
    """
    xx, xy, xt, yy, yt, tt = covariance
    return (
        xx - 2.0 * dy * xt + dy * dy * tt,
        xy + dx * xt - dy * yt - dx * dy * tt,
        xt - dy * tt,
        yy + 2.0 * dx * yt + dx * dx * tt,
        yt + dx * tt,
        tt,
    )
