"""builtin_interfaces/Time <-> whole nanoseconds."""

from builtin_interfaces.msg import Time

SECOND = 1_000_000_000
"""Nanoseconds."""


def nanoseconds(stamp: Time) -> int:
    """Nanoseconds since the epoch of the clock."""
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def stamp_of(ns: int) -> Time:
    """The stamp of some nanoseconds since the epoch."""
    sec, nanosec = divmod(ns, SECOND)
    return Time(sec=sec, nanosec=nanosec)
