"""The parts of a running world: plugin hooks, observers and requests."""
