"""ROS messages, also damaged ones, and a peer that exchanges messages with the nodes."""
