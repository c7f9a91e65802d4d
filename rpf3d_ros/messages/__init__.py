"""Conversion between ROS messages and values of the core; this folder creates no node and no thread."""
