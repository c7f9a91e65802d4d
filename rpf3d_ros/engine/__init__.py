"""The threads of the simulator: they receive messages, build the terrain and fly rocks.

The thread that decides on alerts is in rpf3d_ros/alerts.
"""
