"""Checks that a world and the process are as before after an error."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from waiting import wait_until

import flatland


@dataclass(frozen=True)
class Resources:
    """What a world must not leave behind.

    Attributes:
        threads: The running threads.
        descriptors: Number of open file descriptors, without the sockets that a ROS node of other
            tests in this process opens at any time.
    """

    threads: frozenset[threading.Thread]
    descriptors: int

    @classmethod
    def now(cls) -> Resources:
        """Returns those of this process."""
        count = 0
        for descriptor in Path("/proc/self/fd").iterdir():
            with suppress(OSError):  # another thread has closed it
                count += not str(descriptor.readlink()).startswith("socket:")
        return cls(frozenset(threading.enumerate()), count)

    def within(self, before: Resources) -> bool:
        """Returns whether nothing was added; what other tests left may end in the meantime."""
        return self.threads <= before.threads and self.descriptors <= before.descriptors


def contents(world: flatland.World) -> dict[str, Any]:
    """Returns everything in a world that a failed request must not change."""
    return {
        "models": [model.name for model in world.models],
        "objects": world.physics.object_counts(),
        "outputs": sorted(world.ports.outputs),
        "commands": sorted(world.ports.commands),
        "layers": list(world.collision_filter.names),
        "state": world.state_hash(),
    }


@pytest.fixture
def unchanged() -> Callable[..., AbstractContextManager[None]]:
    """A context at whose end a world, if given, and the process are as before."""

    @contextmanager
    def check(world: flatland.World | None = None) -> Iterator[None]:
        process_before = Resources.now()
        before = contents(world) if world is not None else None
        yield
        # Other threads of this process open descriptors for a moment.
        wait_until("no more resources", lambda: Resources.now().within(process_before))
        if world is not None:
            assert contents(world) == before

    return check


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a valid world, the base of all broken ones."""
    folder = tmp_path_factory.mktemp("broken")
    files = {
        "world.yaml": "properties: {}\n"
        "layers: [{name: 2d, map: map.yaml}, {name: 3d}]\n"
        "models: [{name: first, model: good.model.yaml}]\n",
        "map.yaml": "type: line_segments\ndata: walls.dat\nscale: 1\norigin: [0, 0, 0]\n",
        "walls.dat": "5 -5 5 5\n",
        "mapped.yaml": "properties: {}\nlayers: [{name: 2d, map: input.map.yaml}]\n",
        "good.model.yaml": "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, "
        "density: 1}]}]\n"
        "plugins: [{name: drive, type: DiffDrive, body: base}]\n",
    }
    for name, text in files.items():
        (folder / name).write_text(text)
    cv2.imwrite(str(folder / "map.png"), np.full((4, 4), 255, np.uint8))
    return folder


@pytest.fixture(scope="module")
def running_world(folder: Path) -> Iterator[flatland.World]:
    """A world that has been stepped, for requests that fail."""
    with flatland.World.from_yaml(folder / "world.yaml", seed=1) as world:
        world.step(3)
        yield world
        world.step(3)
        world.spawn_model("good.model.yaml", "later", "later", (2, 0, 0))
