"""Play a bag into the running nodes: publish its input topics as CDR, at the recorded pace, optionally with /clock.

`rpf3d_play_bag BAG --rate 4 --clock` ends with 0 when the last message is published, 2 if the bag cannot be read or if
a topic has too few subscribers.
The stamps in a bag are times of the recording. Nodes that use today's clock treat the sources of a bag as stale, so
start the nodes with use_sim_time:=true. ROS's own arguments (an enclave, for example) follow after --ros-args.
"""

import argparse
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.recorded_topics import RecordedSensors, RecordedTopic
from rpf3d_ros.nodes.leaving import unless_signalled
from rpf3d_ros.nodes.node_process import arguments_of_program
from rpf3d_ros.recording.bag_sensors import HELP
from rpf3d_ros.recording.entries import SECOND
from rpf3d_ros.recording.from_bag import Raw, messages_of, sensors_of, topics_of, unread_of

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.publisher import Publisher

    from rpf3d_ros.interface.simulated_clock import SimulatedClock

CLOCK_AHEAD = 0.5
"""Time (s) before the first message for which /clock already shows that message's time, because nodes need a time."""

LEAVING = 1.0
"""Time (s) between the last message and the end of the program, so that the last messages are delivered."""


def main(args: Sequence[str] | None = None) -> int:
    """Play a bag; return the exit code: 0, 2 for bad input or too few subscribers, 128 + N after signal N."""
    words = sys.argv[1:] if args is None else list(args)
    options = _options(arguments_of_program(words))
    return unless_signalled(lambda: _played(options, words))


def inputs_of(bag: Path, namespace: str, sensors: RecordedSensors | None = None) -> dict[str, RecordedTopic]:
    """Return the topics in a bag that are inputs of the simulator.

    bag, namespace, sensors : as in `topics_of`

    Raises InputError in the cases of `topics_of`, and if the bag has no such topic.
    """
    given = {name: topic for name, topic in topics_of(bag, namespace, sensors).items() if topic.given}
    if not given:
        where = f" in the namespace {namespace}" if namespace else ""
        raise InputError(
            f"{bag}: has no input of the simulator{where}: give the namespace of its topics (--namespace), or its "
            "topics of sources (--source-topics, --source-cloud-topics)"
        )
    return given


def with_times(messages: Iterator[Raw]) -> tuple[Iterator[Raw], int]:
    """Return the messages unchanged, and the time (ns) of the first message with a time above 0; 0 if there is none.

    A recorder on a simulated clock receives the latched terrain at time 0, before the clock begins.
    """
    early = []
    for raw in messages:
        early.append(raw)
        if raw.stamp_ns > 0:
            break
    return chain(early, messages), early[-1].stamp_ns if early else 0


def _options(args: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="rpf3d_play_bag", description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=Path, help="folder of a rosbag2 bag, or its .mcap or .db3 file")
    parser.add_argument("--rate", type=_positive, default=1.0, help="speed relative to the recording")
    parser.add_argument("--namespace", default="", help="namespace of the topics in the bag")
    parser.add_argument("--source-topics", help=HELP.format("poses"))
    parser.add_argument("--source-cloud-topics", help=HELP.format("clouds"))
    parser.add_argument("--clock", action="store_true", help="publish /clock, for nodes with use_sim_time:=true")
    parser.add_argument(
        "--subscribers",
        type=int,
        default=1,
        help="subscribers of each topic to wait for (default 1; with the recorder 2)",
    )
    parser.add_argument("--patience", type=float, default=30.0, help="seconds to wait for the subscribers")
    return parser.parse_args(args)


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def _played(options: argparse.Namespace, words: list[str]) -> int:
    try:
        _play(options, words)
    except InputError as error:
        print(f"rpf3d: {error}", file=sys.stderr)
        return 2
    return 0


def _play(options: argparse.Namespace, words: list[str]) -> None:
    """Publish every input at its time, and print the number of messages of each topic; words : arguments for ROS."""
    sensors = sensors_of(options.bag, options.source_topics, options.source_cloud_topics)
    inputs = inputs_of(options.bag, options.namespace, sensors)
    played = dict.fromkeys(inputs, 0)
    for sentence in unread_of(options.bag, options.namespace, sensors):
        print(f"rpf3d: {sentence}", file=sys.stderr)
    import rclpy
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    from rpf3d_ros.interface.publishing import publishers_of

    rclpy.init(args=words, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node("rpf3d_play_bag", start_parameter_services=False)
        publishers = publishers_of(node, inputs, inputs)
        messages = messages_of(options.bag, options.namespace, sensors)
        given = (raw for raw in messages if raw.topic in publishers)
        timed, begin_ns = with_times(given)
        with _clock(node, begin_ns) if options.clock else nullcontext() as clock:
            _wait_for_subscribers(publishers, options)
            if clock is not None:
                time.sleep(CLOCK_AHEAD)
                clock.run_at(options.rate)
            began = time.monotonic()
            for raw in timed:
                _wait_until(began + (raw.stamp_ns - begin_ns) / SECOND / options.rate)
                if clock is not None:
                    clock.publish()
                publishers[raw.topic].publish(raw.data)
                played[raw.topic] += 1
            time.sleep(LEAVING)
        print("played", ", ".join(f"{count} of {topic}" for topic, count in played.items()))
    finally:
        rclpy.try_shutdown()


def _clock(node: "Node", begin_ns: int) -> "SimulatedClock":
    """Return a simulated clock that stands still at `begin_ns` (ns) until its method `run_at` is called."""
    from rpf3d_ros.interface.simulated_clock import SimulatedClock

    return SimulatedClock(node, begin_ns, speed=0.0)


def _wait_for_subscribers(publishers: Mapping[str, "Publisher"], options: argparse.Namespace) -> None:
    """Wait until each topic has `options.subscribers` subscribers, at most `options.patience` (s).

    Raises InputError with the names of the topics that have fewer subscribers after this time.
    """
    deadline = time.monotonic() + options.patience
    while few := [each for each, offer in publishers.items() if offer.get_subscription_count() < options.subscribers]:
        if time.monotonic() > deadline:
            raise InputError(
                f"after {options.patience:g} s there are fewer than {options.subscribers} subscribers of "
                f"{', '.join(few)}: check that the simulator runs, and ROS_DOMAIN_ID"
            )
        time.sleep(0.02)


def _wait_until(moment: float) -> None:
    time.sleep(max(0.0, moment - time.monotonic()))


if __name__ == "__main__":
    sys.exit(main())
