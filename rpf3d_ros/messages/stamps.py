"""Convert builtin_interfaces/Time to whole nanoseconds and back."""

from builtin_interfaces.msg import Time

SECOND = 1_000_000_000
"""One second in nanoseconds."""


def nanoseconds(stamp: Time) -> int:
    """Return a stamp in nanoseconds since the epoch of its clock."""
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def stamp_of(ns: int) -> Time:
    """Return the stamp of a time in nanoseconds since the epoch."""
    sec, nanosec = divmod(ns, SECOND)
    return Time(sec=sec, nanosec=nanosec)
