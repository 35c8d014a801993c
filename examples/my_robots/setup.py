"""Tells catkin where the Python package is; run by catkin_python_setup() only."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["my_robots"], package_dir={"": "src"}))
