"""The policy as a network: it chooses a heading, follows it, and brakes before obstacles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor, nn

from flatland.gym.observations import GOAL_SCALE

if TYPE_CHECKING:
    from flatland.gym import FlatlandVectorEnv

HEADINGS: Final = 72
STATE: Final = 2  # numbers of the state: the last heading as a unit vector
_UNITS: Final = 256
_OTHERS: Final = 7  # features besides the scan
_HALF: Final = 1.0  # m, range in the middle of the scale of the scan
_PERSISTENCE: Final = 1.0  # of the last heading, in units of logarithms of probabilities
_BLOCKED: Final = 6.0  # disadvantage of a heading without free distance, in the same units
_NEEDED: Final = 0.5  # m, free distance above which there is no disadvantage
_MARGIN: Final = 0.05  # m, as that of `Gap`
_STANDING: Final = 0.02  # m, free distance with which the robot stands
_DECELERATION: Final = 1.0  # m/s², with which it expects to brake


class Network(nn.Module):
    """Actions for the default observation: `Scan()`, `Goal()` and `Velocity()`.

    The learned part computes a logit for each of 72 headings. All before and after it is fixed:

    - The scan is rotated into the frame of the goal, whose first axis points to the goal, in whole
      beams. Situations that differ only in the heading of the robot are therefore nearly equal.
    - Headings along which the robot cannot drive get a disadvantage.
    - The last heading increases the logits of the headings next to it, so that the robot does not
      turn around between two ways that are equally good. It is the state, (0, 0) at the start of an
      episode.
    - The robot turns to the best heading, and is only as fast as it can brake within the free
      distance along its present and its new heading.
    """

    def __init__(self, envs: FlatlandVectorEnv) -> None:
        """Creates a network with random weights for the robot of environments.

        Args:
            envs: The environments, whose laser is at the center of the robot, with equal angles
                between all beams, the first of which points backwards.
        """
        super().__init__()
        episodes = envs.episodes
        agent, situation = episodes.agents[0], episodes.situation
        self.beams = situation.ranges.shape[1]
        self.max_range = float(situation.max_range)
        self.features_size = self.beams + HEADINGS + _OTHERS
        self._dt = episodes.settings.dt
        self._reach = agent.radius + _MARGIN
        self.register_buffer("_low", torch.tensor(situation.low, dtype=torch.float32))
        self.register_buffer("_high", torch.tensor(situation.high, dtype=torch.float32))
        self.register_buffer("_beams", _directions(self.beams))
        self.register_buffer("_headings", _directions(HEADINGS))
        self.register_buffer("_numbers", torch.arange(self.beams))
        # Of the beams in the frames of the headings.
        self.register_buffer("_cos", self._headings @ self._beams.T)
        self.register_buffer(
            "_sin",
            self._headings[:, :1] * self._beams[:, 1] - self._headings[:, 1:] * self._beams[:, 0],
        )
        self._layers = nn.Sequential(
            nn.Linear(self.features_size, _UNITS),
            nn.ReLU(),
            nn.Linear(_UNITS, _UNITS),
            nn.ReLU(),
            nn.Linear(_UNITS, HEADINGS),
        )

    def forward(self, observation: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Returns actions and the next states.

        Args:
            observation: Observations, shape (n, beams + 5).
            state: The states of the last call, shape (n, 2); zeros at the start of an episode.

        Returns:
            Actions in [-1, 1], shape (n, 2), and states, shape (n, 2).
        """
        features, frames = self.features(observation)
        return self.follow(observation, state, features, frames)

    def features(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the input of the learned part in the frames of the goals.

        Args:
            observation: Observations, shape (n, beams + 5).

        Returns:
            Features, shape (n, beams + 79), and the angles of the frames in those of the robots
            [rad], shape (n,).
        """
        scan, goal, velocity = observation.split((self.beams, 3, 2), dim=1)
        # The bearing of a goal at the place of the robot is (0, 0), of which ONNX has no angle.
        cos = torch.where(goal[:, 1] == 0.0, goal.new_tensor(1e-9), goal[:, 1])
        shift = torch.round(torch.atan2(goal[:, 2], cos) * (self.beams / math.tau))
        index = torch.remainder(self._numbers + shift.to(torch.int64)[:, None], self.beams)
        ranges = torch.gather(scan, 1, index) * self.max_range
        distance = goal[:, :1] * GOAL_SCALE
        free = self._free(ranges[:, None], self._cos, self._sin)
        features = (
            1.0 - 2.0 * ranges / (ranges + _HALF),
            free.clamp(max=2.0) - 1.0,
            distance / 3.0 - 1.0,
            distance.clamp(max=1.0),
            distance.clamp(max=3.0) / 3.0,
            goal[:, 1:],
            velocity,
        )
        return torch.cat(features, dim=1), shift * (math.tau / self.beams)

    def mirrored(self, features: Tensor) -> Tensor:
        """Returns the features of the situation in which left and right are exchanged."""
        signs = features.new_tensor((1.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0))
        # The first beam and the first heading point backwards.
        scan, free, others = features.split((self.beams, HEADINGS, _OTHERS), dim=1)
        return torch.cat((_mirrored(scan), _mirrored(free), others * signs), dim=1)

    def logits(self, features: Tensor) -> Tensor:
        """Returns the logits of all headings in the frames of the goals, shape (n, 72)."""
        logits: Tensor = self._layers(features)
        return logits

    def follow(
        self, observation: Tensor, state: Tensor, features: Tensor, frames: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Returns actions and states as `forward`, from the features and their frames."""
        yaw_rate = observation[:, self.beams + 4] * torch.maximum(-self._low, self._high)[1]
        # The last heading in the frame of the goal.
        c, s = _unit(-yaw_rate * self._dt - frames).unbind(1)
        last = torch.stack(
            (c * state[:, 0] - s * state[:, 1], s * state[:, 0] + c * state[:, 1]), 1
        )
        scores = torch.log(torch.softmax(self.logits(features), dim=1) + 1e-4)
        free = features[:, self.beams : self.beams + HEADINGS] + 1.0
        needed = (observation[:, self.beams : self.beams + 1] * GOAL_SCALE).clamp(max=_NEEDED)
        blocked = (1.0 - free / needed.clamp(min=0.1)).clamp(0.0, 1.0)
        best = _peak(scores + _PERSISTENCE * last @ self._headings.T - _BLOCKED * blocked)
        heading = torch.remainder(best + frames + math.pi, math.tau) - math.pi
        return self.drive(observation, heading), _unit(heading)

    def drive(self, observation: Tensor, heading: Tensor) -> Tensor:
        """Returns actions that turn to headings and then drive.

        Args:
            observation: Observations, shape (n, beams + 5).
            heading: Headings in the frames of the robots [rad], shape (n,).
        """
        ranges = observation[:, : self.beams] * self.max_range
        # Until the robot has turned, it drives on along its present heading.
        ways = torch.stack((heading, torch.zeros_like(heading)), dim=1)
        c, s = torch.cos(ways)[..., None], torch.sin(ways)[..., None]
        ahead, left = self._beams.unbind(1)
        free = self._free(ranges[:, None], c * ahead + s * left, c * left - s * ahead)
        free = free.amin(dim=1).clamp(min=0.0)
        change = _DECELERATION * self._dt
        speed = torch.sqrt(change * change + 2.0 * _DECELERATION * free) - change
        # On a curve, the robot leaves the line that is free.
        speed = torch.minimum(speed, self._high[0]) * torch.cos(heading).clamp(min=0.0) ** 4
        commands = torch.stack((speed, heading / (2.0 * self._dt)), dim=1)
        actions = 2.0 * (commands - self._low) / (self._high - self._low) - 1.0
        return actions.clamp(-1.0, 1.0)

    def _free(self, ranges: Tensor, cos: Tensor, sin: Tensor) -> Tensor:
        """Returns how far each robot can drive along headings [m].

        Args:
            ranges: Ranges [m], shape (n, 1, beams).
            cos: Cosines of the beams in the frames of the headings, shape (n, k, beams) or (k,
                beams).
            sin: Their sines.

        Returns:
            Distances, shape (n, k).
        """
        along, across = ranges * cos, ranges * sin
        # Points within the margin block only the ways that lead nearer to them.
        discs = (ranges - 1e-3).clamp(0.0, self._reach)
        squared = discs * discs - across * across
        blocks = (squared > 0.0) & (along > 0.0) & (ranges < self.max_range)
        distances = along - torch.sqrt(squared.clamp(min=0.0))
        distances = torch.where(blocks, distances, distances.new_tensor(self.max_range))
        return distances.amin(dim=2) - _STANDING


def positions(angles: Tensor) -> Tensor:
    """Returns the positions of angles [rad] on the circle of headings, from 0 to 72."""
    return torch.remainder((angles + math.pi) * (HEADINGS / math.tau), HEADINGS)


def _peak(scores: Tensor) -> Tensor:
    """Returns the angle of the highest score, between the headings around it [rad], shape (n,)."""
    best = torch.argmax(scores, dim=1, keepdim=True)
    offsets = torch.arange(-2, 3)
    around = torch.gather(scores, 1, torch.remainder(best + offsets, HEADINGS))
    weights = torch.softmax(around, dim=1)
    return (best[:, 0] + (weights * offsets).sum(dim=1)) * (math.tau / HEADINGS) - math.pi


def _mirrored(values: Tensor) -> Tensor:
    """Returns values at equal angles from -pi at the opposite angles, shape (n, count)."""
    return torch.cat((values[:, :1], values[:, 1:].flip(1)), dim=1)


def _unit(angles: Tensor) -> Tensor:
    """Returns the unit vectors at angles [rad], shape (n, 2)."""
    return torch.stack((torch.cos(angles), torch.sin(angles)), dim=1)


def _directions(count: int) -> Tensor:
    """Returns the unit vectors at equal angles from -pi, shape (count, 2)."""
    return _unit(math.tau / count * torch.arange(count) - math.pi)
