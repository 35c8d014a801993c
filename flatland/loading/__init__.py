"""Loaders that build a world or a model from its YAML file."""
