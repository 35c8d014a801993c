"""The worlds of an environment, with their agents, episodes and pictures."""

from __future__ import annotations

import gc
import importlib
import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt
from gymnasium.error import ClosedEnvironmentError

from flatland.checks import shown
from flatland.drawing.render import MATPLOTLIB_LOCK, make_figure
from flatland.gym.episodes import Episodes
from flatland.gym.live_view import EpisodeView, check_live_view, checked_port
from flatland.gym.stock import Stock
from flatland.plugin_api.body_drive import BodyDrive
from flatland.runtime.randomization import randomize_plugins

if TYPE_CHECKING:
    from flatland.geometry import Vector2
    from flatland.gym.agents import Agent
    from flatland.gym.settings import Settings
    from flatland.gym.tasks import Task
    from flatland.world import World

Image = npt.NDArray[np.uint8]

RENDER_MODES: Final = ("rgb_array", "human")
_SIZE: Final = (800, 600)  # pixels
_DPI: Final = 80.0
_IDLE_PER_WORLD: Final = 3


class Stage:
    """The part that all environments share.

    Attributes:
        worlds: The worlds; each contains the same number of agents. With several buildings,
            `restore` replaces them.
        episodes: The episodes of the agents of all worlds, in this order.
        metadata: What Gymnasium and PettingZoo read from an environment.
    """

    def __init__(
        self,
        settings: Settings,
        names: Sequence[str],
        find_agents: Callable[[World], list[Agent]],
        *,
        render_mode: str | None,
        web_port: int | None,
        metadata: Mapping[str, Any],
        num_threads: int = 1,
    ) -> None:
        """Loads the worlds and copies them.

        Args:
            settings: The arguments of the environment.
            names: Name of each world for users.
            find_agents: Returns the agents of a world.
            render_mode: `rgb_array`, `human` or None.
            web_port: Port of the viewer of the render mode `human`, see `FlatlandEnv`.
            metadata: Metadata of the class of the environment.
            num_threads: Number of threads that step and scan, 0 for one per core.

        Raises:
            DependencyNotInstalled: `human` requires aiohttp.
            FlatlandError: A file is missing or invalid, a model cannot be an agent, or the robots
                of several buildings differ; no world is left open.
            MemoryError: There is not enough memory for the worlds.
            ValueError: An argument is out of range.
        """
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ValueError(
                f"render_mode must be None or one of {', '.join(RENDER_MODES)}, got "
                f"{shown(render_mode)}"
            )
        if web_port is not None:
            web_port = checked_port(web_port)
        if render_mode == "human":
            check_live_view(web_port)
        self.metadata = {**metadata, "render_fps": round(1 / settings.dt) or 1}
        self._render_mode = render_mode
        with _paused_collector(), ExitStack() as undo:
            self._stocks: list[Stock] = []
            for building in range(settings.building_count):
                original = undo.enter_context(settings.load(building))
                original.physics.share_walls()
                if not self._stocks and max(len(names), settings.building_count) > 1:
                    _check_memory(len(names), settings.building_count, original.snapshot().size)
                self._stocks.append(Stock(building, original, find_agents))
            if len(self._stocks) == 1:
                # The original is the world of the first environment; it is copied before.
                clones = [undo.enter_context(original.clone()) for _ in names[1:]]
                self._used = [self._stocks[0].prepare(each) for each in (original, *clones)]
                firsts = self._used[:1]
            else:
                firsts = []
                for stock in self._stocks:
                    undo.callback(stock.close)
                    firsts.append(stock.take())
                    stock.idle.append(firsts[-1])
                self._used = []
                for number in range(len(names)):
                    self._used.append(self._stocks[number % len(self._stocks)].take())
                    undo.callback(self._used[-1].world.close)
            self.worlds = [each.world for each in self._used]
            agents = [agent for each in self._used for agent in each.agents]
            _warn_about_timeouts(agents, settings.dt)
            buildings = [each.building for each in self._used for _ in each.agents]
            self.episodes = Episodes(
                agents, settings, num_threads, buildings, [each.agents[0] for each in firsts]
            )
            self._view = EpisodeView(self.worlds, names, settings.dt, web_port)
            undo.pop_all()

    @property
    def goals(self) -> list[list[Vector2]]:
        """The goals in each world, in the world frame [m]."""
        goals = [(x, y) for x, y in self.episodes.situation.goals.tolist()]
        count = len(goals) // len(self.worlds)
        return [goals[start : start + count] for start in range(0, len(goals), count)]

    def set_task(self, task: Task) -> None:
        """Replaces the task of all further episodes; running ones and their goals remain.

        Raises:
            ClosedEnvironmentError: The environment is closed.
            TypeError: It is no task.
            WorldError: The task is impossible in a building; the previous one remains.
        """
        self.check_open()
        with ExitStack() as undo:
            firsts = []
            for stock in self._stocks:
                if len(self._stocks) == 1:
                    # The world of an episode, which continues.
                    first = self._used[0]
                    undo.callback(first.world.restore, first.world.snapshot())
                else:
                    first = stock.take()
                    undo.callback(stock.idle.append, first)
                first.world.restore(first.start)
                firsts.append(first.agents[0])
            self.episodes.set_task(task, firsts)

    def restore(self, number: int, rng: np.random.Generator) -> None:
        """Returns a world to its state before any episode, and draws what is random at its start.

        With several buildings, one is drawn first.

        Args:
            number: Index of the world.
            rng: Source of the building and of the seeds; the noise is a function of its state.

        Raises:
            WorldError: A plugin found no free place.
        """
        if len(self._stocks) > 1:
            self._enter(number, int(rng.integers(len(self._stocks))))
        world = self.worlds[number]
        world.restore(self._used[number].start)
        randomize_plugins(world.models, world.plugins, rng)
        self.episodes.randomization.change_world(world, rng)

    def _enter(self, number: int, building: int) -> None:
        """Replaces a world by one of another building."""
        previous = self._used[number]
        if previous.building == building:
            return
        entered = self._stocks[building].take()
        self._used[number] = entered
        self.worlds[number] = entered.world
        count = len(entered.agents)
        for row, agent in enumerate(entered.agents, number * count):
            self.episodes.replace(row, agent, building)
        self._stocks[previous.building].idle.append(previous)
        # A new world takes milliseconds; idle ones are kept as far as they are likely to be used.
        if sum(len(stock.idle) for stock in self._stocks) > _IDLE_PER_WORLD * len(self.worlds):
            largest = max(self._stocks, key=lambda stock: len(stock.idle))
            largest.idle.pop(0).world.close()

    def render(self) -> list[Image] | None:
        """Returns an image of each world for `rgb_array`; for `human`, shows all in the browser.

        Raises:
            ClosedEnvironmentError: The environment is closed.
            FlatlandError: The viewer cannot listen on its port, or matplotlib is missing.
        """
        self.check_open()
        radius = self.episodes.goal_radius
        if self._render_mode == "rgb_array":
            pairs = zip(self.worlds, self.goals, strict=True)
            return [_draw(world, goals, radius) for world, goals in pairs]
        if self._render_mode == "human":
            self._view.show(self.goals, radius)
        return None

    def check_open(self) -> None:
        """Checks that the environment is open.

        Raises:
            ClosedEnvironmentError: The environment is closed.
        """
        if self.worlds[0].closed:
            raise ClosedEnvironmentError("the environment is closed")

    def image(self) -> Image | None:
        """Returns what `render` of an environment with one world returns; see `render`."""
        images = self.render()
        return None if images is None else images[0]

    def show(self) -> None:
        """Shows the worlds in the browser, in the render mode `human`."""
        if self._render_mode == "human":
            self.render()

    def close(self) -> None:
        """Closes all worlds and their view; further calls have no effect."""
        with ExitStack() as closing:
            for stock in self._stocks:
                closing.callback(stock.close)
            for world in reversed(self.worlds):
                closing.callback(world.close)
            self._view.close()
            self.episodes.close()


@contextmanager
def _paused_collector() -> Iterator[None]:
    """Pauses the collector of garbage, which would examine all worlds again and again."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _warn_about_timeouts(agents: Iterable[Agent], dt: float) -> None:
    """Warns about robots that stop between two actions.

    Args:
        agents: The agents of all environments.
        dt: Simulated time between two actions [s].
    """
    limits = {
        agent.model.name: agent.drive.command_timeout
        for agent in agents
        if isinstance(agent.drive, BodyDrive) and 0 < agent.drive.command_timeout < dt
    }
    for name, limit in limits.items():
        warnings.warn(
            f'model "{name}" stops between two actions: its command_timeout of {limit:g} s is '
            f"shorter than the {dt:g} s between them",
            stacklevel=3,
        )


def _check_memory(count: int, buildings: int, size: int) -> None:
    """Checks that there is enough memory for the worlds of environments.

    Args:
        count: Number of environments.
        buildings: Number of buildings; of several, there is one more world of each.
        size: Memory of a world [bytes].

    Raises:
        MemoryError: There is not; the text states how much is needed.
    """
    available = _available_memory()
    needed = size * (count if buildings == 1 else max(count, buildings) + buildings)
    if needed > available:
        raise MemoryError(
            f"{count} environments need about {needed / 1e9:.1f} GB, and "
            f"{available / 1e9:.1f} GB are available"
        )


def _available_memory() -> float:
    """Returns the memory that the process may use in addition [bytes]; inf if it is unknown."""
    numbers = re.search(r"MemAvailable:\s+(\d+) kB", _read("/proc/meminfo"))
    machine = 1024.0 * int(numbers[1]) if numbers else math.inf
    limit, used = (_read(f"/sys/fs/cgroup/memory.{name}").strip() for name in ("max", "current"))
    group = float(limit) - float(used) if limit.isdigit() and used.isdigit() else math.inf
    return min(machine, group)


def _read(path: str) -> str:
    try:
        return Path(path).read_text()
    except OSError:
        return ""


def _draw(world: World, goals: Iterable[Vector2], radius: float) -> Image:
    """Draws a world with goals.

    Args:
        world: The world.
        goals: Goals in the world frame [m].
        radius: Distance at which an agent has arrived [m].

    Returns:
        RGB image, top row first, shape (height, width, 3).

    Raises:
        FlatlandError: matplotlib is missing.
    """
    figure = make_figure(world, size=_SIZE, dpi=_DPI)
    patches = importlib.import_module("matplotlib.patches")
    with MATPLOTLIB_LOCK:
        for goal in goals:
            figure.axes[0].add_patch(patches.Circle(goal, radius, color="tab:green", alpha=0.6))
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())
    return np.ascontiguousarray(pixels[:, :, :3])
