"""Receive large messages on a separate thread, without blocking other threads.

Smaller messages that must stay in order with the large messages are received here, too. rclpy holds the interpreter's
lock while it takes a message: a mesh of 56 MB, which rclpy copies twice, blocks every thread of a node for 0.1 s and
more. This module calls the function of rcl through ctypes, which releases the lock, and does not copy the bytes.
Messages of several topics that have arrived are passed on in the order in which they were published. The transport of
a large message takes time, so the message may arrive after a small message that was published later. Therefore the
time of publication is passed on with each message.
"""

import ctypes
import os
import select
import threading
import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from rclpy._rclpy_pybind11 import InvalidHandle
from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from rpf3d_ros.engine.in_order import InOrder
from rpf3d_ros.engine.message_gaps import MessageGaps, Numbered
from rpf3d_ros.interface.qos import OVERRIDABLE, depth_of
from rpf3d_ros.messages.refusals import report_error
from rpf3d_ros.messages.terrain_messages import Buffer

PAUSE = 0.01
"""Time (s) between two checks for messages while messages arrive.

A check takes a few microseconds; waking the thread takes ten times as long.
"""

WITHOUT_ARRIVALS = 0.03
"""Time (s) between two checks if nothing wakes the thread when a message arrives."""

AT_LEAST_EVERY = 1.0
"""Longest time (s) between two checks; until then the thread sleeps, unless the middleware announces a message."""

AFTER_ERROR = 1.0
"""Time (s) until the next check after rcl has reported an error."""

NOT_NUMBERED = 2**64 - 1
"""Value in place of a message's number if the middleware does not number messages.

The constant is RMW_MESSAGE_INFO_SEQUENCE_NUMBER_UNSUPPORTED of rmw.
"""

OK, NOTHING_THERE = 0, 401
"""Return codes of rcl (RCL_RET_OK, RCL_RET_SUBSCRIPTION_TAKE_FAILED in rcl/types.h)."""


class _Allocator(ctypes.Structure):
    """The structure rcutils_allocator_t of rcl, for ctypes."""

    _fields_ = tuple(
        (name, ctypes.c_void_p) for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    )


class _Serialized(ctypes.Structure):
    """The structure rcl_serialized_message_t of rcl (rcutils_uint8_array_t), for ctypes."""

    _fields_ = (
        ("buffer", ctypes.c_void_p), ("length", ctypes.c_size_t), ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    )  # fmt: skip


class _Info(ctypes.Structure):
    """The structure rmw_message_info_t for ctypes, with room for later fields."""

    _fields_ = (
        ("published_ns", ctypes.c_int64), ("received_ns", ctypes.c_int64), ("number", ctypes.c_uint64),
        ("reception", ctypes.c_uint64), ("implementation", ctypes.c_void_p), ("publisher", ctypes.c_uint8 * 16),
        ("rest", ctypes.c_int64 * 25),
    )  # fmt: skip


class _Sentence(ctypes.Structure):
    """The structure rcutils_error_string_t of rcl, for ctypes."""

    _fields_ = (("text", ctypes.c_char * 1024),)


class _Rcl:
    """The C functions of rcl that are called through ctypes, from the libraries that rclpy has loaded."""

    def __init__(self) -> None:
        """Load the functions. Raises OSError or AttributeError if they do not exist under their usual names."""
        rcl, rcutils = ctypes.CDLL("librcl.so"), ctypes.CDLL("librcutils.so")
        self.take: Any = rcl.rcl_take_serialized_message
        self.take.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Serialized), ctypes.POINTER(_Info), ctypes.c_void_p]
        self.allocator: Any = rcutils.rcutils_get_default_allocator
        self.allocator.restype = _Allocator
        self.free: Any = rcutils.rcutils_uint8_array_fini
        self.free.argtypes = [ctypes.POINTER(_Serialized)]
        self.error: Any = rcutils.rcutils_get_error_string
        self.error.restype = _Sentence
        self.reset_error: Any = rcutils.rcutils_reset_error
        self.call_on_arrival: Any = rcl.rcl_subscription_set_on_new_message_callback
        self.call_on_arrival.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]


@cache
def _rcl() -> _Rcl | None:
    try:
        return _Rcl()
    except (OSError, AttributeError):
        return None


class NotByTheExecutor(CallbackGroup):
    """A callback group whose subscriptions the executor does not read, because another thread reads them.

    The executor still handles the events of the subscriptions, such as an incompatible QoS.
    """

    def can_execute(self, entity: object) -> bool:
        """True if the executor may handle the entity, that is if it is not a subscription."""
        return not isinstance(entity, Subscription)

    def beginning_execution(self, entity: object) -> bool:
        """Return `can_execute`; rclpy calls this before it handles an entity."""
        return self.can_execute(entity)

    def ending_execution(self, entity: object) -> None:
        """Do nothing; rclpy calls this after it has handled an entity."""


class LargeTopic(NamedTuple):
    """A topic of large messages, and the function that receives them.

    kind : class of the messages in rclpy; take : called with the CDR bytes and the time of publication (ns) of each
        message
    lost : called before `take` if earlier messages were lost, with the number of lost messages and the time of
        publication (ns) of the message that follows; None if losses do not matter, because only the last message counts
    """

    kind: Any
    name: str
    take: Callable[[Buffer, int], None]
    qos: QoSProfile
    lost: Callable[[int, int], None] | None = None


class TakenMessage(NamedTuple):
    """A message that was taken from a queue: its CDR bytes, and the number of messages that were lost before it."""

    data: Buffer
    lost: int = 0


class LargeMessages:
    """Subscriptions to large messages, which are passed on as CDR bytes (memoryview) on a separate thread.

    The messages are in the order of publication (`InOrder`). If the functions of rcl are missing, the executor passes
    the messages on as `bytes`, in the order of arrival, and lost messages are not noticed.

    topics : the topics to subscribe to; events : callbacks of rclpy for events of the subscriptions, None for none
    failed : called with a sentence and the current time (ns since the epoch) if rcl cannot take messages, and with ""
        and the current time at the first check without errors
    refused : called with the topic, the time of publication (ns) and the error for each message whose callback raises
    """

    def __init__(
        self, node: Node, topics: Sequence[LargeTopic], failed: Callable[[str, int], None],
        refused: Callable[[str, int, BaseException], None], events: SubscriptionEventCallbacks | None = None,
    ) -> None:  # fmt: skip
        self._node, self._failed, self._refused = node, failed, refused
        self._rcl = _rcl()
        group = None if self._rcl is None else NotByTheExecutor()
        self._topics = topics
        self._subscriptions: list[Any] = [
            node.create_subscription(
                topic.kind, topic.name, partial(self._take_from_rclpy, topic), topic.qos, callback_group=group,
                raw=True, event_callbacks=events, qos_overriding_options=OVERRIDABLE,
            )
            for topic in topics
        ]  # fmt: skip
        self._closed = threading.Event()
        rcl = self._rcl
        queues = [] if rcl is None else [_Queue(each, rcl, self._closed) for each in self._subscriptions]
        self._arrivals = None if rcl is None else _arrivals_of(self._subscriptions, rcl)
        self._order = InOrder([queue.take for queue in queues])
        self._errors = ""
        self._thread: threading.Thread | None = None
        if self._rcl is not None:
            self._thread = threading.Thread(target=self._run, name="rpf3d large messages", daemon=True)
            self._thread.start()

    @property
    def qos(self) -> dict[str, QoSProfile]:
        """The quality of service of each subscription, with overrides, by the name of its topic."""
        return {topic.name: each.qos_profile for topic, each in zip(self._topics, self._subscriptions, strict=True)}

    def close(self) -> None:
        """End all subscriptions; a message that is being processed is completed first."""
        self._closed.set()
        if self._arrivals is not None:
            self._arrivals.wake()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        if self._arrivals is not None:
            self._arrivals.close()
            self._arrivals = None
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions = []

    def _run(self) -> None:
        usual = WITHOUT_ARRIVALS if self._arrivals is None else PAUSE
        pause = usual
        while not self._closed.wait(pause):
            if self._arrivals is not None and not self._order.keeps_some and not self._order.errors:
                self._arrivals.wait(AT_LEAST_EVERY)
            for message in self._order.ready():
                self._hand_on(self._topics[message.queue], message.content.data, message.at_ns, message.content.lost)
            if any(isinstance(error, InvalidHandle) for error in self._order.errors):  # the node is being destroyed
                return
            self._report(self._order.errors)
            pause = AFTER_ERROR if self._order.errors else usual

    def _take_from_rclpy(self, topic: LargeTopic, data: bytes, info: Mapping[str, int]) -> None:
        """Pass on a message that the executor of rclpy has taken; info : the message information of rclpy."""
        self._hand_on(topic, data, info["source_timestamp"])

    def _hand_on(self, topic: LargeTopic, content: Buffer, published_ns: int, lost: int = 0) -> None:
        """Pass a message to the callbacks of its topic; if one raises, report this to `refused` without raising.

        content : the CDR bytes; published_ns : time of publication (ns)
        lost : number of messages that were lost before this message
        """
        try:
            if lost and topic.lost is not None:
                topic.lost(lost, published_ns)
            topic.take(content, published_ns)
        except Exception as error:
            if self._node.context.ok():  # otherwise a signal has shut the context down
                report_error(partial(self._refused, topic.name, published_ns), error)

    def _report(self, errors: Sequence[Exception]) -> None:
        """Report the errors of a check if they differ from the previous check; report "" when they have ended.

        errors : the errors of this check, empty without errors
        """
        sentence = "; ".join(dict.fromkeys(f"{type(error).__name__}: {error}" for error in errors))
        if sentence == self._errors or not self._node.context.ok():
            return
        self._errors, now = sentence, time.time_ns()
        report_error(lambda _: self._failed(sentence, now), RuntimeError(sentence))


class _Arrivals:
    """Lets a thread sleep until a message arrives, by an eventfd of Linux that the middleware itself writes to.

    The callback of a new message has the arguments (user data, number of messages), and `eventfd_write` of the C
    library has (descriptor, number). So the address of `eventfd_write` is the callback, and the descriptor is its user
    data: on 64-bit systems both calls use the same registers. A function in Python would make a thread of the
    middleware wait for the interpreter's lock.
    """

    def __init__(self, subscriptions: Sequence[Any], rcl: _Rcl) -> None:
        """Ask the middleware to announce the messages of all subscriptions.

        Raises OSError if there is no free descriptor, or if the middleware has no callback for new messages.
        """
        self._descriptor = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._poll = select.poll()
        self._poll.register(self._descriptor, select.POLLIN)
        self._subscriptions, self._rcl = subscriptions, rcl
        if not self._call_back(ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p), self._descriptor):
            self.close()
            raise OSError("the middleware does not announce messages")
        self.wake()  # a message that arrived just before its subscription got the callback is not announced

    def wait(self, seconds: float) -> None:
        """Return when a message has arrived since the last call, after `wake`, or after `seconds`."""
        if self._poll.poll(1000.0 * seconds):
            os.eventfd_read(self._descriptor)

    def wake(self) -> None:
        """End the current or the next call of `wait`."""
        os.eventfd_write(self._descriptor, 1)

    def close(self) -> None:
        """End the callbacks; call this while no thread waits, and before the subscriptions are destroyed."""
        if self._call_back(None, None):  # otherwise a callback could write into a file that has got this descriptor
            os.close(self._descriptor)

    def _call_back(self, function: Any, data: int | None) -> bool:
        """Set the callback of all subscriptions; return False if the middleware has refused it for any of them.

        function, data : address of a C function, and its user data; None and None to end the callbacks
        """
        accepted = True
        for subscription in self._subscriptions:
            with suppress(InvalidHandle), subscription.handle:  # invalid if the node has been destroyed
                if self._rcl.call_on_arrival(subscription.handle.pointer, function, data) != OK:
                    self._rcl.reset_error()
                    accepted = False
        return accepted


class _Queue:
    """The received messages of one subscription, taken through rcl.

    Checks are frequent, and most find no message. Therefore all checks use the same C structures until a message is
    found, which then owns the structure with its bytes.
    """

    def __init__(self, subscription: Any, rcl: _Rcl, closed: threading.Event) -> None:
        self._handle, self._rcl, self._closed = subscription.handle, rcl, closed
        self._gaps = MessageGaps(depth_of(subscription.qos_profile))
        self._info = _Info()
        self._message = _Serialized(allocator=rcl.allocator())

    def take(self) -> tuple[int, TakenMessage] | None:
        """Return the publication time (ns) and the next message; None if no message waits, and after closing.

        Raises RuntimeError if rcl reports an error.
        """
        if self._closed.is_set():
            return None
        rcl, message, info = self._rcl, self._message, self._info
        with self._handle:  # keeps rclpy from destroying the subscription meanwhile
            code = rcl.take(self._handle.pointer, ctypes.byref(message), ctypes.byref(info), None)
        if code == NOTHING_THERE and not message.buffer:
            return None
        self._message = _Serialized(allocator=rcl.allocator())
        if code == OK:
            lost = self._gaps.lost_before(_numbered(info), time.time_ns())
            return info.published_ns, TakenMessage(_viewed(message, rcl), lost)
        rcl.free(ctypes.byref(message))
        why = rcl.error().text.decode(errors="replace")
        rcl.reset_error()
        if code != NOTHING_THERE:
            raise RuntimeError(f"messages cannot be received: rcl returned {code}, {why}")
        return None


def _arrivals_of(subscriptions: Sequence[Any], rcl: _Rcl) -> _Arrivals | None:
    """Return an object with which a thread can wait for messages of the subscriptions; None if this is impossible.

    It is impossible on systems without eventfd (other than Linux), on 32-bit systems, without a free descriptor, and if
    the middleware has no callback for new messages. The thread must then check for messages at regular intervals.
    """
    if not hasattr(os, "eventfd") or ctypes.sizeof(ctypes.c_size_t) < ctypes.sizeof(ctypes.c_uint64):
        return None
    with suppress(OSError):
        return _Arrivals(subscriptions, rcl)
    return None


def _numbered(info: _Info) -> Numbered:
    number = None if info.number == NOT_NUMBERED else info.number
    return Numbered(number=number, received_ns=info.received_ns, publisher=bytes(info.publisher))


def _viewed(message: _Serialized, rcl: _Rcl) -> memoryview:
    """Return a view of a message's bytes in rcl's memory; the memory is freed when no view is left."""
    owner = (ctypes.c_ubyte * message.length).from_address(message.buffer or 0)
    weakref.finalize(owner, rcl.free, ctypes.byref(message)).atexit = False
    return memoryview(np.ctypeslib.as_array(owner))
