"""A table of episodes of a robot, over worlds, seeds and controllers, on many machines."""
