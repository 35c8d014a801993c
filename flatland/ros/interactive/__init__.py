"""Interactive markers that move, rotate and delete models."""
