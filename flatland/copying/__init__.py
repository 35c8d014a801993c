"""Saving and copying the Python objects that the state of a world consists of."""
