"""The ROS 1 side: a node, and a bridge between a world's ports and topics.

Nothing outside of this package imports it; the simulation runs without ROS.
"""
