"""The ROS 2 nodes of rpf3d: they receive and convert messages, call the core (`rpf3d_core`), and publish results."""
