"""Run one node in one process: start, spin until a signal, end cleanly.

Modules that take long to import are imported after the signal handlers are set. Otherwise Python's KeyboardInterrupt
could occur inside an import or a C++ call.
"""

import contextlib
import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from rpf3d_ros.nodes.free_output import flush_output
from rpf3d_ros.nodes.heap import return_large_arrays

if TYPE_CHECKING:
    from rclpy.executors import Executor
    from rclpy.node import Node

BAD_INPUT = 2
"""Exit code if a parameter or a file is refused, the same as of the command `rpf3d`."""

USAGE = "parameters come after --ros-args: --params-file FILE, -p NAME:=VALUE (docs/reference/parameters.md lists them)"

SOURCE_PLACE = re.compile(r",? at /\S+:\d+")
"""Pattern of a file and line of rcl's C code in an error message; it is removed from messages to users."""


def run(make_node: "Callable[[], Node]", args: Sequence[str] | None = None) -> int:
    """Run a node until a signal; return 0 after SIGINT or SIGTERM, BAD_INPUT if arguments or parameters are refused.

    With --help, print the usage and return 0. If a thread of the node could not be ended, do not return, but end the
    process with exit code 0. Raise any other error of the node.

    make_node : returns the node; the first line of its module's docstring is printed for --help
    """
    listening = _leave_on_signals()
    unknown = arguments_of_program(sys.argv[1:] if args is None else args)
    if {"-h", "--help"} & set(unknown):
        purpose = (sys.modules[make_node.__module__].__doc__ or "").partition("\n")[0]
        print(f"{purpose}\n{USAGE}")
        return 0
    if unknown:
        return _refused(f"unknown argument {unknown[0]}: {USAGE}")
    return_large_arrays()
    import rclpy

    from rpf3d_ros.nodes.timed_executor import TimedExecutor

    try:
        rclpy.init(args=list(args) if args is not None else None)
        executor = TimedExecutor()  # raises an error if a signal has shut the context down
    except RuntimeError as error:  # RCLError, which has no public name
        return _refused(SOURCE_PLACE.sub("", " ".join(str(error).split())))
    listening.append(True)
    return _spin(make_node, executor)


def arguments_of_program(args: Sequence[str]) -> list[str]:
    """Return the program's own arguments: all arguments outside of --ros-args ... --."""
    own, ros = [], False
    for word in args:
        if word == "--ros-args" or (ros and word == "--"):
            ros = not ros
        elif not ros:
            own.append(word)
    return own


def _leave_on_signals() -> list[bool]:
    """Set signal handlers, and return a list; a signal ends the process as long as the list is empty.

    The caller adds an item to the list when rclpy begins to handle signals.
    """
    listening: list[bool] = []

    def leave(number: int, frame: object) -> None:
        if not listening:
            _leave_at_once()

    signal.signal(signal.SIGINT, leave)
    signal.signal(signal.SIGTERM, leave)
    return listening


def _spin(make_node: "Callable[[], Node]", executor: "Executor") -> int:
    import rclpy
    from rclpy.exceptions import ROSInterruptException
    from rclpy.executors import ExternalShutdownException

    from rpf3d_core.errors import InputError

    node = None
    try:
        node = make_node()
        executor.add_node(node)
        executor.spin()
    except InputError as error:
        return _refused(str(error))
    except (ExternalShutdownException, ROSInterruptException):
        pass
    except Exception:
        if rclpy.ok():  # an exception after a signal has shut the context down is not an error
            raise
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    if getattr(node, "abandoned", False):
        _leave_at_once()
    return 0


def _refused(sentence: str) -> int:
    with contextlib.suppress(OSError):  # a reader of the output that hangs must not change the exit code
        print(f"rpf3d: {sentence}", file=sys.stderr)
    return BAD_INPUT


def _leave_at_once() -> None:
    """End the process immediately with exit code 0, even while rocks fly or modules are imported.

    Python's own exit would wait for threads, such as those that fly rocks.
    """
    flush_output()
    os._exit(0)
