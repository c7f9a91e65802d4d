"""Run a node that only waits, with as many topics as the simulator, to compare its CPU time with the simulator's."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import Empty

PUBLISHERS, SUBSCRIPTIONS = 12, 8
"""Numbers of topics that the simulator publishes and subscribes to (docs/reference/topics.md)."""
PERIOD = 1.0
"""Time (s) between calls of the node's timer, as often as the simulator publishes diagnostics."""


def main() -> None:
    """Wait until the process is ended."""
    rclpy.init()
    node = Node("rpf3d_idle")
    for number in range(PUBLISHERS):
        node.create_publisher(Empty, f"idle/published_{number}", 10)
    for number in range(SUBSCRIPTIONS):
        node.create_subscription(Empty, f"idle/heard_{number}", lambda message: None, 10)
    node.create_timer(PERIOD, lambda: None)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
