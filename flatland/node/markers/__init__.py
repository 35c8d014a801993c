"""Markers of layers and models for RViz and the viewer."""
