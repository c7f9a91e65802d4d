"""Look transforms up in a buffer of tf2, which the node fills from /tf and /tf_static.

tf2_ros is imported only if a parameter asks for transforms, because pip cannot install it.
"""

from typing import Any

from rclpy.node import Node
from rclpy.time import Time

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.transforms import NEWEST, FoundTransform
from rpf3d_ros.messages.stamps import nanoseconds

LATEST = Time()
"""The time 0, for which tf2 returns the newest transform."""

ANY_TIME = 1
"""A time (ns) for which tf2 has a static transform, but not a dynamic transform with the stamp 0."""


class TfTransforms:
    """Transforms that a node receives from tf2. Any thread may look up; a lookup does not wait."""

    def __init__(self, node: Node) -> None:
        """Subscribe to transforms. Raises InputError if tf2_ros cannot be imported."""
        try:
            import tf2_ros
        except ImportError as error:
            raise InputError(
                f"use_tf is true, but tf2_ros cannot be imported ({error}): install the ROS package tf2_ros_py and "
                f"source its setup file, or set use_tf to false"
            ) from error
        self._refusals: Any = tf2_ros.TransformException
        self._buffer: Any = tf2_ros.Buffer()  # without the node: with it, tf2 would offer a service of its own
        self._listener: Any = tf2_ros.TransformListener(self._buffer, node)

    def lookup(self, target: str, source: str, stamp_ns: int) -> FoundTransform | str:
        """Return the transform from `source` into `target` without waiting; if there is none, the reason as text.

        stamp_ns : time (ns) of the transform, NEWEST for the newest of all; if all transforms are older than this time,
            the newest is returned

        A chain of static transforms is valid for all times, and tf2 returns it with the stamp 0. A dynamic transform
        may wrongly have the stamp 0, too. Therefore a second lookup follows, at another time; it fails for such a
        dynamic transform. Every error becomes a reason, because an error that leaves a callback would end the process.
        """
        try:
            newest = self._buffer.lookup_transform(target, source, LATEST)
            newest_ns = nanoseconds(newest.header.stamp)
            if newest_ns > 0 and (stamp_ns == NEWEST or newest_ns < stamp_ns):
                return _found(newest, newest_ns)
            found = self._buffer.lookup_transform(target, source, Time(nanoseconds=stamp_ns or ANY_TIME))
            return _found(found, stamp_ns if newest_ns > 0 else None)
        except self._refusals as refusal:
            return str(refusal) or type(refusal).__name__
        except Exception as error:
            return f"{type(error).__name__}: {error}".removesuffix(": ")

    def clear(self) -> None:
        """Forget all transforms except static transforms, because the clock went back."""
        self._buffer.clear()

    def close(self) -> None:
        """Unsubscribe from /tf and /tf_static."""
        self._listener.unregister()


def _found(transform: Any, stamp_ns: int | None) -> FoundTransform:
    turn, shift = transform.transform.rotation, transform.transform.translation
    return FoundTransform(
        quaternion=(turn.x, turn.y, turn.z, turn.w), translation=(shift.x, shift.y, shift.z), stamp_ns=stamp_ns
    )
