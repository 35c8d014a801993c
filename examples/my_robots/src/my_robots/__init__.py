"""Plugins for the simulator flatland."""
