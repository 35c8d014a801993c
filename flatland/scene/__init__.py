"""Descriptions of what is seen of a world: layers, bodies, shapes, joints and scans.

The values are plain: numbers, texts and numpy arrays, copied out of the world between two steps.
Images, the viewer in the browser and the markers of the ROS node are made from them.
"""
