"""Replace tf2_ros, which pip cannot install, by the names, exceptions and rules of tf2_ros that rpf3d uses.

Tests put this folder on the path of Python. The rules are those of tf2's BufferCore. A lookup for the time 0 uses the
newest time that all dynamic transforms of the chain have, or 0 if there are none. Between two samples, a transform is
interpolated; before the first and after the last sample, a lookup fails. pip cannot install tf2_msgs either, so each
message on the topics is one geometry_msgs/TransformStamped.
"""

import time as wall_clock
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Header

from rpf3d_ros.messages.stamps import nanoseconds, stamp_of

AT_ONCE = Duration()
"""The default timeout of lookups: they do not wait."""

CACHE = 10 * 1_000_000_000
"""Time (ns) for which transforms are kept, as by default in tf2."""


class TransformException(Exception): ...


class LookupException(TransformException): ...


class ConnectivityException(TransformException): ...


class ExtrapolationException(TransformException): ...


class InvalidArgumentException(TransformException): ...


class TimeoutException(TransformException): ...


class Pose(NamedTuple):
    """A transform from a child frame into its parent: rotation as a quaternion (4,) x, y, z, w; translation (3,) m."""

    turn: np.ndarray
    shift: np.ndarray

    def after(self, first):
        """Return the transform that applies `first`, then this transform."""
        return Pose(multiplied(self.turn, first.turn), self.shift + rotated(self.turn, first.shift))

    def inverse(self):
        """Return the transform from the parent into the child."""
        back = self.turn * (-1.0, -1.0, -1.0, 1.0)
        return Pose(back, -rotated(back, self.shift))


STILL = Pose(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3))


def multiplied(p, q):
    """Return the product of two quaternions x, y, z, w."""
    vector = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3])
    return np.array([*vector, p[3] * q[3] - p[:3] @ q[:3]])


def rotated(q, v):
    """Return the vector v (3,) rotated by the unit quaternion q (4,) x, y, z, w."""
    return multiplied(multiplied(q, np.array([*v, 0.0])), q * (-1.0, -1.0, -1.0, 1.0))[:3]


def between(one, other, share):
    """Return a transform between two samples: linear translation, and rotation at a constant rate.

    share : place between the samples, from 0 (`one`) to 1 (`other`)
    """
    turn = other.turn if one.turn @ other.turn >= 0.0 else -other.turn
    angle = np.arccos(min(one.turn @ turn, 1.0))
    parts = np.array([1.0 - share, share]) if angle < 1e-9 else np.sin(angle * np.array([1.0 - share, share]))
    mixed = parts[0] * one.turn + parts[1] * turn
    return Pose(mixed / np.linalg.norm(mixed), (1.0 - share) * one.shift + share * other.shift)


class Link(NamedTuple):
    """The transforms of a frame into its parent.

    samples : time (ns) -> transform; a static link has one transform, at time 0, which is valid for all times
    """

    parent: str
    samples: dict
    is_static: bool

    def at(self, stamp_ns):
        """Return the transform at a time (ns). Raises ExtrapolationException outside the samples of a dynamic link."""
        if self.is_static:
            return self.samples[0]
        times = sorted(self.samples)
        if stamp_ns in self.samples:
            return self.samples[stamp_ns]
        if not times[0] < stamp_ns < times[-1]:
            where, at = ("future", times[-1]) if stamp_ns > times[-1] else ("past", times[0])
            raise ExtrapolationException(
                f"Lookup would require extrapolation into the {where}.  Requested time {stamp_ns / 1e9:.6f} but the "
                f"{'latest' if where == 'future' else 'earliest'} data is at time {at / 1e9:.6f}"
            )
        later = next(i for i, each in enumerate(times) if each > stamp_ns)
        one, other = times[later - 1], times[later]
        return between(self.samples[one], self.samples[other], (stamp_ns - one) / (other - one))


class Buffer:
    """Keeps transforms between frames, and looks transforms up."""

    def __init__(self, cache_time=None, node=None):
        self._links = {}

    def set_transform(self, transform, authority):
        link = self._links.get(transform.child_frame_id)
        kept = {} if link is None or link.is_static or link.parent != transform.header.frame_id else link.samples
        kept = {**kept, nanoseconds(transform.header.stamp): pose_of(transform)}
        kept = {at: pose for at, pose in kept.items() if at >= max(kept) - CACHE}
        self._links[transform.child_frame_id] = Link(transform.header.frame_id, kept, False)

    def set_transform_static(self, transform, authority):
        self._links[transform.child_frame_id] = Link(transform.header.frame_id, {0: pose_of(transform)}, True)

    def clear(self):
        self._links = {child: link for child, link in self._links.items() if link.is_static}

    def can_transform(self, target_frame, source_frame, time, timeout=AT_ONCE, return_debug_tuple=False):
        until = wall_clock.monotonic() + timeout.nanoseconds / 1e9
        while (found := self._core(target_frame, source_frame, time))[0] is None and wall_clock.monotonic() < until:
            wall_clock.sleep(0.02)
        told = (found[0] is not None, str(found[1] or ""))
        return told if return_debug_tuple else told[0]

    def lookup_transform(self, target_frame, source_frame, time, timeout=AT_ONCE):
        self.can_transform(target_frame, source_frame, time, timeout)
        found, error = self._core(target_frame, source_frame, time)
        if error is not None:
            raise error
        return found

    def _core(self, target, source, time):
        try:
            return self._found(target, source, time.nanoseconds), None
        except TransformException as error:
            return None, error

    def _found(self, target, source, stamp_ns):
        up, down = self._chain(source, "source_frame"), self._chain(target, "target_frame")
        common = next((frame for frame in up if frame in down), None)
        if common is None:
            raise ConnectivityException(
                f"Could not find a connection between '{target}' and '{source}' because they are not part of the same "
                f"tree.Tf has two or more unconnected trees."
            )
        up, down = up[: up.index(common)], down[: down.index(common)]
        dynamic = [self._links[each] for each in (*up, *down) if not self._links[each].is_static]
        at = stamp_ns or min((max(link.samples) for link in dynamic), default=0)
        found = self._walked(down, at).inverse().after(self._walked(up, at))
        return message_of(found, target, source, at)

    def _walked(self, frames, stamp_ns):
        walked = STILL
        for frame in frames:
            walked = self._links[frame].at(stamp_ns).after(walked)
        return walked

    def _chain(self, frame, argument):
        if frame.startswith("/"):
            raise InvalidArgumentException(
                f'Invalid argument "{frame}" passed to lookupTransform: frame ids cannot start with a /'
            )
        if frame not in self._links and frame not in {link.parent for link in self._links.values()}:
            raise LookupException(f'"{frame}" passed to lookupTransform argument {argument} does not exist. ')
        chain = [frame]
        while chain[-1] in self._links:
            chain.append(self._links[chain[-1]].parent)
        return chain


class TransformListener:
    """Subscribes to /tf and /tf_static, and puts the received transforms into a buffer."""

    def __init__(self, buffer, node, *, spin_thread=False, qos=None, static_qos=None):
        self.buffer, self.node = buffer, node
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.tf_sub = node.create_subscription(TransformStamped, "/tf", self.callback, qos or 100)
        self.tf_static_sub = node.create_subscription(
            TransformStamped, "/tf_static", self.static_callback, static_qos or latched
        )

    def __del__(self):
        self.unregister()

    def unregister(self):
        self.node.destroy_subscription(self.tf_sub)
        self.node.destroy_subscription(self.tf_static_sub)

    def callback(self, transform):
        self.buffer.set_transform(transform, "default_authority")

    def static_callback(self, transform):
        self.buffer.set_transform_static(transform, "default_authority")


def pose_of(message):
    """Return the transform in a message."""
    turn, shift = message.transform.rotation, message.transform.translation
    return Pose(np.array([turn.x, turn.y, turn.z, turn.w]), np.array([shift.x, shift.y, shift.z]))


def message_of(pose, parent, child, stamp_ns=0):
    """Return a message of a transform from a child frame into its parent."""
    (x, y, z, w), (e, n, h) = pose.turn.tolist(), pose.shift.tolist()
    return TransformStamped(
        header=Header(stamp=stamp_of(stamp_ns), frame_id=parent), child_frame_id=child,
        transform=Transform(rotation=Quaternion(x=x, y=y, z=z, w=w), translation=Vector3(x=e, y=n, z=h)),
    )  # fmt: skip
