"""Acknowledge the alert of a running simulator, so that its level may fall; the log records the person and the reason.

`rpf3d_acknowledge "J. Meyer" "no movement since 14:10, ramp inspected"` ends with 0 if the level was lowered or the
fault of an unknown level has ended, 1 if the simulator refuses and gives the reason, 2 if no simulator answers, 3 if
the result is not yet known, because the simulator or the disk of its decision log is slow, 4 if the site demands that
another person acknowledges, too. ROS's own arguments (an enclave, for example) follow after --ros-args.
"""

import argparse
import sys
import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from rpf3d_core.alerts.levels import ANOTHER_PERSON
from rpf3d_core.errors import InputError
from rpf3d_ros.messages.refusals import TAKEN_UP
from rpf3d_ros.nodes.leaving import unless_signalled
from rpf3d_ros.nodes.node_process import arguments_of_program

if TYPE_CHECKING:
    from rcl_interfaces.srv import SetParameters
    from rclpy.node import Node
    from rclpy.task import Future


SIMULATOR = "rpf3d_simulator"
"""Name of the simulator's node, in any namespace."""
LOOK = 0.1
"""Time (s) between two checks whether a simulator is visible in the ROS graph."""

NOT_YET = 3
"""Exit code if the result is not yet known."""

NOT_ALONE = 4
"""Exit code if the acknowledgement waits for another person."""


class ResultUnknown(InputError):
    """Raised if the acknowledgement was sent but not answered in time, so it may have lowered the level."""


def main(args: Sequence[str] | None = None) -> int:
    """Acknowledge the alert; return the exit code: 0 after success, else 1 to 4, or 128 + a signal's number.

    0 : the level was lowered, or the fault of an unknown level has ended; 1 : refused; 2 : no answer of a simulator
    3 : the result is not known yet; 4 : another person must acknowledge, too
    """
    words = sys.argv[1:] if args is None else list(args)
    options = _options(arguments_of_program(words))
    return unless_signalled(lambda: _acknowledged(options, words))


def acknowledged_by_request(acknowledged_by: str) -> "SetParameters.Request":
    """Return the request to the simulator's `set_parameters` that must precede `~/acknowledge`.

    acknowledged_by : "NAME: REASON"
    """
    from rcl_interfaces.srv import SetParameters
    from rclpy.parameter import Parameter

    who = Parameter("acknowledged_by", Parameter.Type.STRING, acknowledged_by)
    return SetParameters.Request(parameters=[who.to_parameter_msg()])


def _options(args: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="rpf3d_acknowledge", description=__doc__.splitlines()[0])
    parser.add_argument("by", type=_sentence, help="name of the person who acknowledges")
    parser.add_argument("why", type=_sentence, help="reason why the level may fall")
    parser.add_argument("--node", help="full name of the simulator; default: the simulator of this namespace")
    parser.add_argument("--patience", type=float, default=5.0, help="seconds to wait for the simulator")
    options = parser.parse_args(args)
    if ":" in options.by:
        parser.error("the name must not contain a colon, which separates the name from the reason")
    return options


def _sentence(text: str) -> str:
    if not text.strip():
        raise argparse.ArgumentTypeError("the text is empty")
    return text


def _acknowledged(options: argparse.Namespace, words: list[str]) -> int:
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    rclpy.init(args=words, signal_handler_options=SignalHandlerOptions.NO)
    try:
        lowered, message = _ask(options)
    except InputError as error:
        print(f"rpf3d: {error}", file=sys.stderr)
        return NOT_YET if isinstance(error, ResultUnknown) else 2
    finally:
        rclpy.try_shutdown()
    if message == TAKEN_UP:
        print(message)
        return NOT_YET
    print(message if lowered else f"not lowered: {message}")
    if not lowered and ANOTHER_PERSON in message:
        return NOT_ALONE
    return 0 if lowered else 1


def _ask(options: argparse.Namespace) -> tuple[bool, str]:
    """Ask the simulator to acknowledge; return whether it succeeded, and the simulator's message.

    The acknowledgement has succeeded if the level was lowered, or the fault of an unknown level has ended. Raises
    InputError if the simulator does not answer, ResultUnknown if the acknowledgement was sent and is not answered.
    """
    from rcl_interfaces.srv import SetParameters
    from rclpy.node import Node
    from std_srvs.srv import Trigger

    node = Node("rpf3d_acknowledge", start_parameter_services=False)  # asks two services, and serves none
    until = time.monotonic() + options.patience
    options.node = options.node or _simulator_in_namespace(node, until)
    set_parameters = node.create_client(SetParameters, f"{options.node}/set_parameters")
    acknowledge = node.create_client(Trigger, f"{options.node}/acknowledge")
    for each in (set_parameters, acknowledge):
        if not each.wait_for_service(max(until - time.monotonic(), 0.1)):
            raise InputError(f"{options.node} does not answer: check that it runs, its name, and ROS_DOMAIN_ID")
    request = acknowledged_by_request(f"{options.by}: {options.why}")
    (taken,) = _answer(node, set_parameters.call_async(request), options).results
    if not taken.successful:
        return False, taken.reason
    try:
        response = _answer(node, acknowledge.call_async(Trigger.Request()), options)
    except InputError as late:
        raise ResultUnknown(str(late)) from None
    return response.success, response.message


def _simulator_in_namespace(node: "Node", until: float) -> str:
    """Return the full name of the simulator in the node's namespace.

    until : time (s, monotonic) at which the search ends

    Raises InputError if there is none; the message names the simulators of other namespaces. A simulator of another
    namespace is never returned, because it may belong to another pit.
    """
    own = f"{node.get_namespace().rstrip('/')}/{SIMULATOR}"
    names: list[str] = []
    while time.monotonic() < until:
        time.sleep(LOOK)
        names = simulators_among(name for name, _kinds in node.get_service_names_and_types())
        if own in names:
            return own
    others = f"; or choose a running simulator with --node: {', '.join(names)}" if names else ""
    raise InputError(f"{own} does not answer: check that it runs, its name, and ROS_DOMAIN_ID{others}")


def simulators_among(services: Iterable[str]) -> list[str]:
    """Return the full names of the simulators, in alphabetical order, from the names of all services.

    >>> simulators_among(["/pit_a/rpf3d_simulator/acknowledge", "/rpf3d_recorder/get_parameters"])
    ['/pit_a/rpf3d_simulator']
    """
    end = f"/{SIMULATOR}/acknowledge"
    return sorted(name.removesuffix("/acknowledge") for name in services if name.endswith(end))


def _answer(node: "Node", asked: "Future", options: argparse.Namespace) -> Any:
    """Return the answer of a service. Raises InputError if there is none within `options.patience` (s).

    asked : the pending call of the service
    """
    import rclpy

    rclpy.spin_until_future_complete(node, asked, timeout_sec=options.patience)
    if not asked.done():
        raise InputError(f"{options.node} has not answered within {options.patience:g} s: see alerts for the result")
    return asked.result()


if __name__ == "__main__":
    sys.exit(main())
