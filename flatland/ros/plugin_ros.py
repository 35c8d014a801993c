"""The documented name of the class of `self.ros`, which all kinds of ROS share."""

from flatland.node.plugin_ros import PluginRos as PluginRos
