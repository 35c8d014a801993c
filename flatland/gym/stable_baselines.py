"""A vector of environments as stable-baselines3 expects it.

The module requires stable-baselines3, which the extra `learning` installs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from flatland.extras import require
from flatland.gym.fleet_vector import FleetVectorEnv
from flatland.gym.vector import FlatlandVectorEnv

require("stable_baselines3", "flatland.gym.stable_baselines requires")

from stable_baselines3.common.vec_env import VecEnv


class StableVector(VecEnv):  # type: ignore[misc, unused-ignore]
    """Passes a `FlatlandVectorEnv` or a `FleetVectorEnv` to stable-baselines3.

    stable-baselines3 has a class of its own for several environments. It expects that an episode
    that ends is followed by the next one in the same step, and the last observation in the info.
    """

    def __init__(self, envs: FlatlandVectorEnv | FleetVectorEnv) -> None:
        """Wraps environments of the autoreset mode `SAME_STEP`.

        Raises:
            ValueError: They have another mode.
        """
        if envs.autoreset_mode is not AutoresetMode.SAME_STEP:
            raise ValueError(f"the autoreset mode must be SAME_STEP, got {envs.autoreset_mode}")
        self.envs = envs
        self.render_mode = envs.render_mode
        self._actions: Any = None
        self._returns = np.zeros(envs.num_envs)
        self._lengths = np.zeros(envs.num_envs, np.int64)
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> Any:
        """Begins an episode in all environments and returns the observations.

        The seeds and the options are those of the last calls of `seed` and `set_options`, which
        apply once.

        Raises:
            WorldError: As `FlatlandVectorEnv.reset`.
            ValueError: An option is unknown or invalid.
        """
        seeds = None if self._seeds[0] is None else list(self._seeds)
        observations, _ = self.envs.reset(seed=seeds, options=_joined(self._options))
        self._reset_seeds()
        self._reset_options()
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return observations

    def step_async(self, actions: Any) -> None:
        """Stores the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, Any, Any, list[dict[str, Any]]]:
        """Steps; the info of an episode that ended contains its return, length and success."""
        observations, rewards, terminated, truncated, infos = self.envs.step(self._actions)
        ended = terminated | truncated
        self._returns += rewards
        self._lengths += infos.get("is_active", True)  # Robots of a fleet may wait.
        details: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for row in np.flatnonzero(ended).tolist():
            final = infos["final_info"]
            details[row] = {
                "terminal_observation": infos["final_obs"][row],
                "TimeLimit.truncated": bool(truncated[row]),
                "is_success": bool(final["is_success"][row]),
                "collision": bool(final["collision"][row]),
                "episode": {"r": float(self._returns[row]), "l": int(self._lengths[row])},
            }
        self._returns[ended] = 0.0
        self._lengths[ended] = 0
        return observations, rewards.astype(np.float32), ended, details

    def close(self) -> None:
        """Closes the environments."""
        self.envs.close()

    def get_images(self) -> Sequence[Any]:
        """Returns an image of each environment."""
        return self.envs.render() or ()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Returns an attribute, which all environments share."""
        return [getattr(self.envs, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Sets the attribute `task` of all environments.

        Raises:
            AttributeError: Another attribute, or some environments only: they share attributes.
        """
        if attr_name != "task" or list(self._get_indices(indices)) != list(range(self.num_envs)):
            raise AttributeError(
                f"{attr_name} cannot be set: the environments share their attributes"
            )
        self.envs.task = value

    def env_method(
        self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any
    ) -> list[Any]:
        """Raises AttributeError: the environments have no methods of their own."""
        raise AttributeError(f"the environments have no method {method_name} of their own")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Returns False for each environment."""
        return [False for _ in self._get_indices(indices)]

    def _get_indices(self, indices: int | Iterable[int] | None) -> Iterable[int]:
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, int) else indices


def _joined(options: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Returns the options of single environments as those of a vector.

    Raises:
        ValueError: An option is unknown or invalid.
    """
    joined: dict[str, Any] = {}
    for name, size in (("start", 3), ("goal", 2)):
        mask = np.array([each.get(name) is not None for each in options])
        if not mask.any():
            continue
        values = np.zeros((len(options), size))
        for row in np.flatnonzero(mask).tolist():
            given = np.asarray(options[row][name])
            if given.shape != (size,) or given.dtype.kind not in "fiu":
                raise ValueError(
                    f"the option {name} of environment {row} must be {size} numbers, got "
                    f"{options[row][name]!r}"
                )
            values[row] = given
        joined |= {name: values, f"{name}_mask": mask}
    unknown = {name for each in options for name in each} - {"start", "goal"}
    if unknown:
        raise ValueError(f"options must be among goal and start, got {', '.join(sorted(unknown))}")
    return joined
