"""The recent states of one world, to which clients can return."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from flatland.errors import PLUGIN_FAULTS, FlatlandError
from flatland.runtime.snapshot import WorldSnapshot, size_of
from flatland.world import World

PERIOD: Final = 1.0  # s of wall time between two regular snapshots, if they cost little
SHARE: Final = 0.01
"""Largest share of a processor for regular snapshots; the garbage collector needs as much again."""
RECENT: Final = 30.0  # s of wall time in which all regular snapshots are kept
COARSE_PERIOD: Final = 5.0  # s of wall time between two older ones
MAX_AGE: Final = 300.0  # s of wall time
MAX_BYTES: Final = 128 * 1024 * 1024  # estimated memory of all snapshots of a world
MAX_MARKED: Final = 8  # snapshots with a label
_MAX_SHARE_OF_BYTES: Final = 0.25  # of a single snapshot
NEWEST: Final = "before going back"  # label of the newest state during a visit
_RETRY_PERIOD: Final = 10.0  # s of wall time after a snapshot that could not be taken


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """A state of the world to which clients can return.

    Attributes:
        number: Number of the moment in the history of its world, from 1 on.
        snapshot: The state.
        label: Why the state was saved, for users; empty for a regular snapshot.
        taken: Wall time at which the snapshot was taken [s].
    """

    number: int
    snapshot: WorldSnapshot
    label: str
    taken: float


@dataclass(frozen=True, slots=True)
class Timeline:
    """What clients receive of a history.

    Attributes:
        moments: Number, simulated time [s] and label of each moment, in the order in which the
            snapshots were taken.
        current: Number of the moment that the paused world shows, None for the newest state.
        obstacle: Why there are no regular snapshots, for users; empty if there are.
    """

    moments: tuple[tuple[int, float, str], ...] = ()
    current: int | None = None
    obstacle: str = ""


class History:
    """Takes snapshots of a world regularly and restores them.

    All methods must be called between two steps. A restored moment is left when the time of the
    world advances or the world is resumed, by whichever client: the moments after it are then
    dropped.
    """

    def __init__(self, world: World, clock: Callable[[], float] = time.monotonic) -> None:
        """Creates an empty history.

        Args:
            world: The world.
            clock: Returns the wall time [s].
        """
        self._world = world
        self._clock = clock
        self._numbers = itertools.count(1)
        self._moments: list[Moment] = []
        self._current: Moment | None = None
        self._obstacle = ""
        self._due = 0.0
        self._state: tuple[int, int] | None = None  # time [ns] and changes at the last snapshot
        self._timeline = Timeline()

    @property
    def timeline(self) -> Timeline:
        """The moments for clients; the same object until there is a change."""
        made = Timeline(
            tuple((m.number, m.snapshot.time, m.label) for m in self._moments),
            None if self._current is None else self._current.number,
            self._obstacle,
        )
        if made != self._timeline:
            self._timeline = made
        return self._timeline

    def update(self) -> None:
        """Takes the next regular snapshot if it is due and the world has changed."""
        self._leave_current()
        now, state = self._clock(), self._state_of_world()
        if self._current is not None or now < self._due or state == self._state:
            return
        self._obstacle = self._find_obstacle()
        self._due = now + PERIOD
        if self._obstacle:
            return
        start = time.thread_time()
        try:
            self._drop_old(self._add().taken)
        except PLUGIN_FAULTS as error:
            self._obstacle = str(error) or repr(error)
            self._due = now + _RETRY_PERIOD
        cost = time.thread_time() - start
        self._due = max(self._due, now + cost / SHARE)

    def mark(self, label: str) -> int:
        """Takes a snapshot of the newest state now, and returns the number of the moment.

        Args:
            label: Why, for users.

        Raises:
            WorldError: A plugin has an attribute that cannot be copied.
        """
        moment = self._add(label)
        self._current = None
        self._drop_old(moment.taken)
        return moment.number

    def restore(self, number: int, restore: Callable[[WorldSnapshot], None]) -> None:
        """Restores a moment, which becomes the newest state of the world.

        Args:
            number: Number of the moment.
            restore: Restores a snapshot of the world.

        Raises:
            FlatlandError: The moment was dropped, or cannot be restored.
        """
        restore(self._find(number).snapshot)
        self._current = None
        self._state = self._state_of_world()

    def visit(self, number: int, restore: Callable[[WorldSnapshot], None]) -> None:
        """Restores a moment to be looked at; the newest state becomes the last moment.

        A visit to the last moment returns to the newest state. The caller pauses the world.

        Args:
            number: Number of the moment.
            restore: Restores a snapshot of the world.

        Raises:
            FlatlandError: The moment was dropped, or the state cannot be saved or restored.
        """
        self._leave_current()
        found = self._find(number)
        newest = self._add(NEWEST) if self._current is None else None
        try:
            restore(found.snapshot)
        except BaseException:
            if newest is not None:
                self._moments.remove(newest)
            raise
        self._current = found
        if found is self._moments[-1]:
            self._moments.pop()
            self._current = None
        self._state = self._state_of_world()

    def clear(self) -> None:
        """Drops all moments; the world stays as it is."""
        self._moments.clear()
        self._current = self._state = None

    def _find(self, number: int) -> Moment:
        for moment in self._moments:
            if moment.number == number:
                return moment
        raise FlatlandError("this state is not kept any more")

    def _add(self, label: str = "") -> Moment:
        moment = Moment(next(self._numbers), self._world.snapshot(), label, self._clock())
        self._moments.append(moment)
        self._state = self._state_of_world()
        return moment

    def _leave_current(self) -> None:
        current, world = self._current, self._world
        if current is None:
            return
        if world.paused and world.timekeeper.sim_time_ns == current.snapshot.time_ns:
            return
        self._current = None
        self._moments = [m for m in self._moments if m.number <= current.number]

    def _state_of_world(self) -> tuple[int, int]:
        return self._world.timekeeper.sim_time_ns, self._world.change_count

    def _find_obstacle(self) -> str:
        """Returns why no regular snapshots are taken, empty if they are."""
        world = self._world
        if world.stepping.change_log is not None:
            # A recording contains each snapshot, and its repetition keeps all of them.
            return "states are not kept while the world is recorded"
        if size_of(world.physics) > _MAX_SHARE_OF_BYTES * MAX_BYTES:
            return "the map is too large to keep earlier states of the world"
        return ""

    def _drop_old(self, now: float) -> None:
        """Keeps fewer of the older moments, and limits their number, age and memory."""
        kept: list[Moment] = []
        for moment in self._moments:
            age = now - moment.taken
            is_near = bool(kept) and moment.taken - kept[-1].taken < 0.9 * COARSE_PERIOD
            is_extra = not moment.label and age > RECENT and is_near
            if age <= MAX_AGE and not is_extra:
                kept.append(moment)
        for moment in [m for m in kept if m.label][:-MAX_MARKED]:
            kept.remove(moment)
        size = sum(moment.snapshot.size for moment in kept)
        while size > MAX_BYTES and len(kept) > 1:
            size -= kept.pop(0).snapshot.size
        self._moments = kept
