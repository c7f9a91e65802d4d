"""A node with as many topics as the simulator that only waits, as the scale for the work of a node at rest."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import Empty

PUBLISHERS, SUBSCRIPTIONS = 12, 8
"""Topics of the simulator (docs/reference/topics.md)."""
PERIOD = 1.0
"""Time (s) between calls of its timer: as the diagnostics of the simulator."""


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
