"""Runs the node: `python -m flatland.ros2 --ros-args -p world_path:=WORLD`."""

import sys

from flatland.ros2.node import main

if __name__ == "__main__":
    sys.exit(main())
