"""What a ROS node of the simulator does, apart from the client library of ROS.

No module here imports a module or message class of ROS. A node consists of this room, a `Transport`
that publishes, subscribes and serves, a writer of messages for the adapters, a source of
parameters, and a main program; see `flatland.ros` for ROS 1 and `flatland.ros2` for ROS 2.
"""
