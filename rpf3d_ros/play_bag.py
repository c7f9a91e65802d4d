"""Play a bag into the running nodes: its input topics as CDR, at the pace they came, optionally with /clock.

`rpf3d_play_bag BAG --rate 4 --clock` ends with 0 when the last message is out, 2 where the bag cannot be read.
"""

import argparse
import sys
import time
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_ros.from_bag import Raw, messages_of
from rpf3d_ros.leaving import unless_signalled
from rpf3d_ros.recorded_topics import TOPICS

SECOND = 1_000_000_000
"""Nanoseconds."""

LEAVING = 1.0
"""Seconds between the last message and the end: a reliable publisher that leaves takes what is on its way along."""


def main(args: Sequence[str] | None = None) -> int:
    """Play a bag; 0, 2 for bad input, 128 + its number after a signal."""
    options = _options(args)
    return unless_signalled(lambda: _played(options))


def inputs_of(bag: Path, namespace: str) -> Iterable[Raw]:
    """What a bag gives the simulator. Raises InputError where that is nothing."""
    given = (raw for raw in messages_of(bag, namespace) if TOPICS[raw.topic].given)
    first = next(given, None)
    if first is None:
        raise InputError(f"{bag}: holds no input of the simulator; is there a namespace to give?")
    return chain([first], given)


def _options(args: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="rpf3d_play_bag", description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=Path, help="folder of a rosbag2 bag, or its .mcap or .db3 file")
    parser.add_argument("--rate", type=_positive, default=1.0, help="how many times as fast as it was recorded")
    parser.add_argument("--namespace", default="", help="namespace of the topics in the bag")
    parser.add_argument("--clock", action="store_true", help="publish /clock, for nodes with use_sim_time")
    parser.add_argument("--subscribers", type=int, default=1, help="subscribers of each topic to wait for")
    parser.add_argument("--patience", type=float, default=30.0, help="seconds to wait for them")
    return parser.parse_args(args)


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is no number above 0")
    return value


def _played(options: argparse.Namespace) -> int:
    try:
        _play(options)
    except InputError as error:
        print(f"rpf3d: {error}", file=sys.stderr)
        return 2
    return 0


def _play(options: argparse.Namespace) -> None:
    """Publish every message at its time."""
    messages = inputs_of(options.bag, options.namespace)
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        player = _Player(options.clock)
        began, first = 0.0, 0
        for raw in messages:
            player.offer(raw.topic, options)
            if not began:
                began, first = time.monotonic(), raw.stamp_ns
            _wait_until(began + (raw.stamp_ns - first) / SECOND / options.rate)
            player.send(raw)
        time.sleep(LEAVING)
    finally:
        rclpy.try_shutdown()


def _wait_until(moment: float) -> None:
    time.sleep(max(0.0, moment - time.monotonic()))


class _Player:
    """A node that publishes CDR on the inputs of the simulator."""

    def __init__(self, clock: bool) -> None:
        from rclpy.node import Node
        from rosgraph_msgs.msg import Clock

        from rpf3d_ros.qos import EVENTS

        self.node = Node("rpf3d_play_bag")
        self._publishers: dict[str, Any] = {}
        self._clock = self.node.create_publisher(Clock, "/clock", EVENTS) if clock else None

    def offer(self, topic: str, options: argparse.Namespace) -> None:
        """Make the publisher of a topic, once, and wait for its subscribers. Raises InputError where none come."""
        if topic in self._publishers:
            return
        from rpf3d_ros.message_classes import message_class
        from rpf3d_ros.qos import given_qos

        kind, offered, _ = TOPICS[topic]
        publisher = self._publishers[topic] = self.node.create_publisher(
            message_class(kind), topic, given_qos(offered)
        )  # fmt: skip
        deadline = time.monotonic() + options.patience
        while publisher.get_subscription_count() < options.subscribers:
            if time.monotonic() > deadline:
                few = f"{topic} has fewer than {options.subscribers} subscribers"
                raise InputError(f"after {options.patience:g} s {few}")
            time.sleep(0.02)

    def send(self, raw: Raw) -> None:
        """Publish a message, and its time before it."""
        if self._clock is not None:
            from builtin_interfaces.msg import Time
            from rosgraph_msgs.msg import Clock

            self._clock.publish(Clock(clock=Time(sec=raw.stamp_ns // SECOND, nanosec=raw.stamp_ns % SECOND)))
        self._publishers[raw.topic].publish(raw.data)


if __name__ == "__main__":
    sys.exit(main())
