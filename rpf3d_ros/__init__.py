"""ROS 2 nodes of rpf3d: receive, convert, call the core, convert, publish. Nothing is computed here."""
