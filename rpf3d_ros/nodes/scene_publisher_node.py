"""rpf3d_scene_publisher: publish terrain and sources of a scene file, as a survey and a radar would.

The program handles signals first, then imports modules that take seconds to load.
"""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rpf3d_ros.nodes.node_process import run

if TYPE_CHECKING:
    from rclpy.node import Node


def node() -> "Node":
    """Return the node; rclpy must be initialised."""
    from rpf3d_ros.nodes.scene_publisher import ScenePublisherNode

    return ScenePublisherNode()


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    return run(node, args)


if __name__ == "__main__":
    sys.exit(main())
