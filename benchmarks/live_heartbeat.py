"""Call a service of a node again and again until SIGINT, to show when the node is blocked; print the times as JSON.

    python benchmarks/live_heartbeat.py rpf3d_simulator/get_parameter_types

Printed are three times of each call: when it was due, when it was sent, and when the reply arrived (ns, monotonic). The
program is a separate process, because a process that publishes messages of 56 MB would measure its own delays.
"""

import json
import signal
import sys
import time

from rcl_interfaces.srv import GetParameterTypes
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

PERIOD = 0.02
"""Time between a reply and the next call (s).

If the node is blocked for 50 ms, this is always noticed, but the block may appear shorter by PERIOD. Calls every 5 ms
would take an eighth of a core in this process, and the same in the node.
"""

PATIENCE = 30.0
"""Longest wait for a reply (s)."""


def main(service: str) -> None:
    """Call the service until SIGINT, then print the times of all calls."""
    ended: list[bool] = []
    signal.signal(signal.SIGINT, lambda number, frame: ended.append(True))
    context = Context()
    context.init()
    node = Node("rpf3d_heartbeat", context=context)
    client = node.create_client(GetParameterTypes, service)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    beats: list[tuple[int, int, int]] = []
    while not ended and not client.service_is_ready():
        time.sleep(PERIOD)
    while not ended:
        due = time.monotonic_ns() + round(PERIOD * 1e9)
        time.sleep(PERIOD)
        sent = time.monotonic_ns()
        future = client.call_async(GetParameterTypes.Request(names=["use_sim_time"]))
        deadline = time.monotonic() + PATIENCE
        while not future.done() and not ended and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.1)
        if future.done():
            beats.append((due, sent, time.monotonic_ns()))
    print(json.dumps(beats))
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()


if __name__ == "__main__":
    main(sys.argv[1])
