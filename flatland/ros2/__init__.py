"""ROS 2: the client library rclpy behind the interface of `flatland.node`, and the main program.

`python -m flatland.ros2 --ros-args -p world_path:=WORLD` runs the node.
"""
