"""rpf3d_alarm_bridge: hold a contact closed only while a simulator's alerts are recent and its alarm is off.

The program handles signals first, then imports modules that take seconds to load.
"""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rpf3d_ros.nodes.free_output import free_output
from rpf3d_ros.nodes.node_process import run

if TYPE_CHECKING:
    from rclpy.node import Node


def node() -> "Node":
    """Return the node; rclpy must be initialised."""
    from rpf3d_ros.nodes.alarm_bridge import AlarmBridgeNode

    return AlarmBridgeNode()


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    with free_output():
        return run(node, args)


if __name__ == "__main__":
    sys.exit(main())
