"""Additions to rclpy's lifecycle nodes: long transitions that a signal can end, and refusal of wrong transitions."""

import functools
import threading
import time
import traceback
from collections.abc import Callable
from typing import Any, TypeVar

from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode

T = TypeVar("T")

LOOK = 0.05
"""Time (s) between checks for a signal while a transition waits."""

REPEAT = 1.0
"""Time (s) between repeated reports of the node's state during a transition."""

BACKWARDS = Duration(nanoseconds=-1)
"""Smallest step back of the clock that is noticed: 1 ns, so every step is noticed."""


class ContextEnded(Exception):
    """Raised if a signal has ended the rclpy context; the work in progress is abandoned."""


def on_a_thread(node: LifecycleNode, work: Callable[[], T], meanwhile: Callable[[], None]) -> T:
    """Do long work on a thread while signals are handled, and return its result.

    meanwhile : called every REPEAT seconds until the work is done

    Raises the exception of the work, or ContextEnded if a signal has ended the context of rclpy.
    """
    found: list[T] = []
    raised: list[BaseException] = []

    def run() -> None:
        try:
            found.append(work())
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=run, name="rpf3d configure", daemon=True)
    thread.start()
    reported_at = time.monotonic()
    while thread.is_alive():
        thread.join(LOOK)
        if not node.context.ok():
            raise ContextEnded
        if time.monotonic() - reported_at >= REPEAT:
            reported_at = time.monotonic()
            meanwhile()
    if raised:
        raise raised[0]
    return found[0]


def refuse_impossible_transitions(node: LifecycleNode) -> None:
    """Make a node refuse requests for transitions that its state does not allow; rclpy would end the node instead."""
    service: Any = node._service_change_state
    change = service.callback

    def refusing(request: Any, response: Any) -> Any:
        try:
            return change(request, response)
        except rclpy_implementation.RCLError as error:
            node.get_logger().warning(f"transition {request.transition.id} refused: {error}")
            response.success = False
            return response

    service.callback = refusing


def noting_errors(transition: Callable[[Any, Any], T]) -> Callable[[Any, Any], T]:
    """Wrap a transition of a node so that its exception is kept in `node.broken`, because rclpy drops exceptions."""

    @functools.wraps(transition)
    def noted(node: Any, state: Any) -> T:
        try:
            return transition(node, state)
        except Exception as error:
            node.broken = f"{type(error).__name__}: {error}"
            if node.context.ok():  # an exception caused by a signal is not an error
                node.get_logger().error(traceback.format_exc())
            raise

    return noted


def watch_clock(node: Any, went_back: Callable[[float], None]) -> None:
    """Arrange that `went_back` is called with the length of the step (s) each time the node's clock goes back.

    ROS reports steps of simulated time only.
    """

    def after(jump: TimeJump) -> None:
        if jump.delta is not None and jump.delta.nanoseconds < 0:
            went_back(-1e-9 * jump.delta.nanoseconds)

    threshold = JumpThreshold(min_forward=None, min_backward=BACKWARDS, on_clock_change=False)
    node._jump_watch = node.get_clock().create_jump_callback(threshold, post_callback=after)
