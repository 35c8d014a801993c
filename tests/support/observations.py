"""What can be observed of a world while it is stepped."""

from __future__ import annotations

import flatland
from flatland.runtime.state_hash import StateHasher

_STEPS_OF_A_HASH = 10  # What differs once differs from then on, and a hash takes milliseconds.


def observations(world: flatland.World, steps: int = 50) -> list[object]:
    """Steps a world and returns what it publishes and where its models are after each step.

    After every tenth step, the hash of the state is among it.

    Args:
        world: The world.
        steps: Number of steps.
    """
    found: list[object] = []
    latest: dict[str, object] = {}
    for step in range(1, steps + 1):
        world.step()
        published = {
            topic: output.latest
            for topic, output in world.ports.outputs.items()
            if output.latest is not latest.get(topic)
        }
        latest.update(published)
        hasher = StateHasher()
        hasher.add(published)
        contacts = repr(world.contacts).count("C")
        state = "" if step % _STEPS_OF_A_HASH else world.state_hash()
        found.append((state, hasher.hexdigest(), world.transforms, contacts))
    return found
