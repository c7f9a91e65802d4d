"""Large messages, taken on a thread of their own and without the interpreter's lock.

rclpy holds that lock while it takes a message: a mesh of 56 MB, copied twice into pages that nobody has touched before,
keeps every thread of a node for 0.1 s and more. Here rcl's own function is called through ctypes, which lets go of the
lock, and the bytes stay where rcl has put them.
"""

import ctypes
import threading
import traceback
import weakref
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from rclpy._rclpy_pybind11 import InvalidHandle
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile

from rpf3d_ros.qos import OVERRIDABLE

PAUSE = 0.02
"""Seconds between looks whether a message has come; to look takes some microseconds."""

OK, NOTHING_THERE = 0, 401
"""RCL_RET_OK, RCL_RET_SUBSCRIPTION_TAKE_FAILED (rcl/types.h)."""


class _Allocator(ctypes.Structure):
    """rcutils_allocator_t."""

    _fields_ = tuple(
        (name, ctypes.c_void_p) for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    )


class _Serialized(ctypes.Structure):
    """rcl_serialized_message_t, which is rcutils_uint8_array_t."""

    _fields_ = (
        ("buffer", ctypes.c_void_p), ("length", ctypes.c_size_t), ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    )  # fmt: skip


class _Rcl:
    """The functions that are called, of the libraries that rclpy has loaded."""

    def __init__(self) -> None:
        """Raises OSError or AttributeError where they are not to be had under their usual names."""
        rcl, rcutils = ctypes.CDLL("librcl.so"), ctypes.CDLL("librcutils.so")
        self.take: Any = rcl.rcl_take_serialized_message
        self.take.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Serialized), ctypes.c_void_p, ctypes.c_void_p]
        self.allocator: Any = rcutils.rcutils_get_default_allocator
        self.allocator.restype = _Allocator
        self.free: Any = rcutils.rcutils_uint8_array_fini
        self.free.argtypes = [ctypes.POINTER(_Serialized)]
        self.reset_error: Any = rcutils.rcutils_reset_error


@cache
def _rcl() -> _Rcl | None:
    try:
        return _Rcl()
    except (OSError, AttributeError):
        return None


class NotByTheExecutor(CallbackGroup):
    """What is in this group no executor looks at."""

    def can_execute(self, entity: object) -> bool:
        """Never."""
        return False

    def beginning_execution(self, entity: object) -> bool:
        """Never."""
        return False

    def ending_execution(self, entity: object) -> None:
        """Nothing has begun."""


class LargeMessages:
    """A subscription that hands on the CDR bytes of each message, as a memoryview, on a thread of its own.

    Where rcl's functions are not to be had, the executor hands them on as `bytes`.
    """

    def __init__(
        self, node: Node, kind: Any, topic: str, callback: Callable[[Any], None], qos: QoSProfile, pause: float = PAUSE
    ) -> None:
        self._node, self._callback, self._pause = node, callback, pause
        rcl = _rcl()
        group = None if rcl is None else NotByTheExecutor()
        self._subscription: Any = node.create_subscription(
            kind, topic, callback, qos, callback_group=group, raw=True, qos_overriding_options=OVERRIDABLE
        )
        self._closed = threading.Event()
        self._thread: threading.Thread | None = None
        if rcl is not None:
            self._thread = threading.Thread(target=self._run, args=(rcl,), name=f"rpf3d {topic}", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Take nothing any more; a message that is being taken is taken to its end first."""
        self._closed.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        self._node.destroy_subscription(self._subscription)

    def _run(self, rcl: _Rcl) -> None:
        while not self._closed.wait(self._pause):
            try:
                while not self._closed.is_set() and (data := self._taken(rcl)) is not None:
                    self._callback(data)
            except InvalidHandle:  # the node is being destroyed
                return
            except Exception:
                if self._node.context.ok():  # what a context says that a signal has shut down is no error
                    self._node.get_logger().error(traceback.format_exc())

    def _taken(self, rcl: _Rcl) -> memoryview | None:
        """The next message; None where there is none."""
        message = _Serialized(allocator=rcl.allocator())
        handle = self._subscription.handle
        with handle:  # so that it is not destroyed meanwhile
            code = rcl.take(handle.pointer, ctypes.byref(message), None, None)
        if code == OK:
            return _viewed(message, rcl)
        rcl.free(ctypes.byref(message))
        rcl.reset_error()
        if code != NOTHING_THERE:
            raise RuntimeError(f"rcl_take_serialized_message said {code}")
        return None


def _viewed(message: _Serialized, rcl: _Rcl) -> memoryview:
    """The bytes of a message where they lie; they are freed with the last that looks at them."""
    owner = (ctypes.c_ubyte * message.length).from_address(message.buffer or 0)
    weakref.finalize(owner, rcl.free, ctypes.byref(message)).atexit = False
    return memoryview(np.ctypeslib.as_array(owner))
