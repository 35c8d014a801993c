"""The viewer: a window that shows a running simulator and takes hold of it.

PyQt5 makes the window, RViz's Python bindings the picture in it. All calls of ROS run in threads
of their own, and what they find comes to the window as Qt signals.
"""
