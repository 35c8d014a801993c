"""Scenarios that score a robot: what happens in them, how they are run, measured and reported."""
