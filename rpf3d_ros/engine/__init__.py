"""The threads of the simulator: they receive messages, build the terrain and fly rocks; rpf3d_ros/alerts decides."""
