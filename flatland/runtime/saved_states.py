"""Saving, restoring and copying the state of a world."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeVar

from flatland.plugin_api.noise import checked_seed
from flatland.runtime.model_states import ModelStates, model_states

if TYPE_CHECKING:
    from flatland.physics import PhysicsWorld
    from flatland.runtime.model_set import ModelSet
    from flatland.runtime.requests import Requests
    from flatland.runtime.snapshot import WorldSnapshot, WorldStates
    from flatland.world import World

R = TypeVar("R")


class SavedStates:
    """The methods of `World` for its state as a whole."""

    physics: PhysicsWorld
    requests: Requests
    _models: ModelSet
    _states: WorldStates

    if TYPE_CHECKING:  # methods of Contents

        def _read(self, action: Callable[[], R]) -> R: ...
        def _change(
            self, kind: str, arguments: Mapping[str, object], action: Callable[[], R]
        ) -> R | None: ...
        def _logged(
            self, kind: str, arguments: Mapping[str, object] | None, action: Callable[[], R]
        ) -> R: ...

    def state(self) -> ModelStates:
        """Returns the names, poses and velocities of all models.

        Raises:
            WorldError: The world is closed.
        """
        return self._read(lambda: model_states(self.physics, self._models.by_name))

    def snapshot(self) -> WorldSnapshot:
        """Returns the current state of the world, for `restore`.

        It includes everything that affects later steps: bodies, contacts, the attributes of
        all plugins with all that they refer to, random numbers, commands, the time and the last
        values of outputs. It does not include pending requests, the pause, observers and
        subscribers.

        Raises:
            WorldError: The world is closed, a plugin calls this, or a plugin has an attribute that
                cannot be copied; see *Snapshots* in `docs/write_a_plugin.md`.
        """
        self.requests.refuse_in_plugin("snapshot")
        number = {"number": self._states.taken}
        return self._read(lambda: self._logged("snapshot", number, self._states.take))

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Returns to an earlier state: the same steps have the same results, bit by bit.

        Models, bodies, plugins, outputs and commands that exist in both states are the same
        objects. Models that were spawned since are deleted, and deleted ones are restored. A
        snapshot can be restored any number of times.

        Args:
            snapshot: Result of `snapshot` of this world.

        Raises:
            WorldError: The world is closed, a plugin calls this, the snapshot is one of another
                world, or a plugin of a deleted model had a connection that has ended.
        """
        self.requests.refuse_in_plugin("restore")
        number = {"number": snapshot.number}
        self._read(lambda: self._logged("restore", number, lambda: self._states.restore(snapshot)))

    def clone(self) -> World:
        """Returns an independent copy of the world in its current state.

        The same steps have the same results in both, bit by bit. They share only immutable
        data, such as parsed files and trees of map edges; the clone can be used in another
        thread and outlives the original. It has no observers, no subscribers other than its own
        plugins, no requests, is not paused, and its plugins have no access to ROS.

        Raises:
            WorldError: The world is closed, a plugin calls this, or a plugin has an attribute that
                cannot be copied; see *Snapshots* in `docs/write_a_plugin.md`.
        """
        self.requests.refuse_in_plugin("clone")
        return self._read(self._states.clone)

    def reset(self, seed: int | None = None, keep_time: bool = False) -> None:
        """Returns to the state after loading: the same steps have the same results, bit by bit.

        All models and plugins end, and those of the world file are created again, with the files
        and parameters as they were when the world was loaded; models spawned since are removed.
        Models, bodies and plugins are new objects and have to be looked up again. Outputs and
        commands that exist before and after, layers, observers and subscribers remain. Pending
        requests and the pause do not change. If a hook of a plugin calls this, it takes effect
        after the step.

        Args:
            seed: Seed of all random numbers, also of those in expressions of the files: the state
                is that after loading with this seed. None for the current seed.
            keep_time: Whether the simulated time continues, instead of starting at 0 again. Updates
                at a rate then continue in phase.

        Raises:
            WorldError: The world is closed or was not loaded from a file.
            FlatlandError: With this seed, a file is invalid, or a plugin fails; the world is as
                before, or empty if a plugin cannot be copied (see `snapshot`).
            ValueError: The seed is negative.
        """
        if seed is not None:
            checked_seed(seed)
        arguments = {"seed": seed, "keep_time": keep_time}
        self._change("reset", arguments, lambda: self._states.reset(seed, keep_time))
