"""Learned policies in ONNX files, which ONNX Runtime computes; requires the extra `onnx`."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flatland.checks import checked_path
from flatland.errors import FlatlandError
from flatland.extras import require
from flatland.geometry import FloatArray
from flatland.gym.observations import Observation
from flatland.gym.staged import episodes_of

if TYPE_CHECKING:
    import gymnasium

    from flatland.geometry import BoolArray

INCLUDED: Final = Path(__file__).parent / "navigate.onnx"
"""The included policy, which drives to goals; see docs/learning.md."""
_METADATA: Final = "flatland"


class PolicyError(FlatlandError):
    """The file of a policy is missing or invalid, or was made for another robot."""

    prefix = "Flatland policy: "


@dataclass(frozen=True, slots=True)
class PolicyRobot:
    """The robot that a policy drives.

    Attributes:
        beams: Number of beams of its laser, at equal angles all around, the first one backwards.
        max_range: Range of the laser [m].
        radius: Radius of the robot [m].
        low: Velocities (v, omega) of the action (-1, -1) [m/s, rad/s].
        high: Velocities of the action (1, 1).
        dt: Duration of an action [s].
    """

    beams: int
    max_range: float
    radius: float
    low: tuple[float, float]
    high: tuple[float, float]
    dt: float

    @classmethod
    def of(
        cls, env: gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any]
    ) -> PolicyRobot:
        """Returns the robot of a `FlatlandEnv` or a `FlatlandVectorEnv`, also within wrappers."""
        episodes = episodes_of(env)
        agent, situation = episodes.agents[0], episodes.situation
        (low_v, low_omega), (high_v, high_omega) = situation.low.tolist(), situation.high.tolist()
        return cls(
            situation.ranges.shape[1],
            float(situation.max_range),
            agent.radius,
            (low_v, low_omega),
            (high_v, high_omega),
            episodes.settings.dt,
        )

    def metadata(self) -> dict[str, str]:
        """Returns the robot as metadata of an ONNX file."""
        values = {name: getattr(self, name) for name in self.__slots__}
        return {_METADATA: json.dumps(values)}

    @classmethod
    def from_metadata(cls, metadata: dict[str, str]) -> PolicyRobot:
        """Returns the robot in the metadata of a file, the inverse of `metadata`.

        Raises:
            ValueError: The metadata are missing or invalid.
        """
        try:
            values = json.loads(metadata[_METADATA])
            (low_v, low_omega), (high_v, high_omega) = values["low"], values["high"]
            return cls(
                int(values["beams"]),
                float(values["max_range"]),
                float(values["radius"]),
                (float(low_v), float(low_omega)),
                (float(high_v), float(high_omega)),
                float(values["dt"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f'invalid metadata "{_METADATA}": {error}') from error


class Policy:
    """A policy with the state of one or several episodes.

    It is called with the default observation of an environment, or with those of a vector, and
    returns actions: `action = policy(observation)`. Each call advances the state. At the start of
    an episode, the state must be reset; `flatland.gym.evaluate` does that.

    Attributes:
        path: The file.
        robot: The robot that the policy drives.
    """

    def __init__(
        self,
        file: str | os.PathLike[str] | None = None,
        env: gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any] | None = None,
    ) -> None:
        """Loads a policy.

        Args:
            file: An ONNX file of examples/learning/train_navigate.py; None for the included policy.
            env: The environment that it shall drive in, whose robot is compared with that of the
                training; None for no comparison.

        Raises:
            MissingPackageError: ONNX Runtime is not installed.
            PolicyError: The file is missing or is not such a policy, or the robot of the
                environment differs.
        """
        runtime = require("onnxruntime", "policies require")
        self.path = INCLUDED if file is None else Path(checked_path("file", file))
        if not self.path.is_file():
            raise PolicyError(f"file not found: {self.path}")
        options = runtime.SessionOptions()
        options.intra_op_num_threads = 1  # The networks are small: threads would wait.
        options.log_severity_level = 3  # Errors are raised.
        try:
            self._session = runtime.InferenceSession(
                str(self.path), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # ONNX Runtime has no common class of errors.
            reason = str(error).partition("\n")[0]
            raise PolicyError(f"{self.path} is not a valid ONNX file: {reason}") from error
        inputs = {each.name: each.shape for each in self._session.get_inputs()}
        outputs = {each.name for each in self._session.get_outputs()}
        if set(inputs) != {"observation", "state"} or outputs != {"action", "next_state"}:
            raise PolicyError(
                f"{self.path} must have the inputs observation and state and the outputs action "
                f"and next_state, got {', '.join(inputs)} and {', '.join(sorted(outputs))}"
            )
        try:
            self.robot = PolicyRobot.from_metadata(
                self._session.get_modelmeta().custom_metadata_map
            )
        except ValueError as error:
            raise PolicyError(f"{self.path} is not a policy of flatland: {error}") from error
        self._size = Observation().layout(self.robot.beams).size
        self._state: FloatArray = np.zeros((1, inputs["state"][1]), np.float32)
        if env is not None and PolicyRobot.of(env) != self.robot:
            raise PolicyError(
                f"{self.path} drives {self.robot}, the environment has {PolicyRobot.of(env)}"
            )

    def check_period(self, dt: float) -> None:
        """Checks that actions have the duration of the training.

        Args:
            dt: Duration of an action [s].

        Raises:
            PolicyError: The duration differs by more than a thousandth.
        """
        if not math.isclose(dt, self.robot.dt, rel_tol=1e-3):
            raise PolicyError(
                f"{self.path} was trained with actions of {self.robot.dt:g} s, here they last "
                f"{dt:g} s"
            )

    def __call__(self, observation: Any) -> FloatArray:
        """Returns the action for an observation, or the actions for several.

        A call with another number of observations than before begins new episodes.

        Args:
            observation: One observation, shape (beams + 5,), or those of a vector, shape (n,
                beams + 5): `Scan()`, `Goal()` and `Velocity()`.

        Returns:
            Actions in [-1, 1], shape (2,), or (n, 2) for several observations.

        Raises:
            ValueError: The observation has another shape.
        """
        values = np.asarray(observation, np.float32)
        if values.ndim not in (1, 2) or values.shape[-1] != self._size:
            raise ValueError(
                f"observations must have the shape ({self._size},) or (n, {self._size}), got "
                f"{values.shape}"
            )
        rows = values.reshape(-1, self._size)
        if len(rows) != len(self._state):
            self._state = np.zeros((len(rows), self._state.shape[1]), np.float32)
        actions: FloatArray
        actions, self._state = self._session.run(
            ("action", "next_state"), {"observation": rows, "state": self._state}
        )
        return actions[0] if values.ndim == 1 else actions

    def reset(self, rows: BoolArray | None = None) -> None:
        """Resets the state at the start of episodes.

        Args:
            rows: Which episodes begin, shape (n,); None for all.
        """
        if rows is None or len(rows) != len(self._state):
            # The next call determines the number of rows.
            self._state = np.zeros((1, self._state.shape[1]), np.float32)
        else:
            self._state[rows] = 0.0
