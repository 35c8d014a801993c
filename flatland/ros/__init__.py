"""The ROS 1 interface: the node, and a bridge between the ports of a world and topics.

No other package except the viewer imports it; the simulation runs without ROS.
"""
