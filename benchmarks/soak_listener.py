"""Subscribe to all topics of a namespace; the soak test kills this process to show that its end disturbs no other.

    python benchmarks/soak_listener.py NAMESPACE
"""

import sys

from rpf3d_ros.demo.stand_in import StandIn
from rpf3d_ros.interface.recorded_topics import TOPICS


def main() -> None:
    """Receive the messages of all topics until the process is killed."""
    with StandIn(name="rpf3d_soak_listener", namespace=sys.argv[1]) as stand_in:
        for topic in TOPICS:
            stand_in.subscribe(topic, lambda data, at_ns: None)
        while True:
            stand_in.spin_once(1.0)


if __name__ == "__main__":
    main()
