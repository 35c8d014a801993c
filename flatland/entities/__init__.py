"""Entities of a world: layers, models, bodies, joints and contacts."""
