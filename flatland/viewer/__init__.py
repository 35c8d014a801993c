"""The viewer: a window that displays a running simulator and controls it.

PyQt5 provides the window, RViz's Python bindings the 3-D view in it. All ROS calls run in
background threads; their results reach the window as Qt signals.
"""
