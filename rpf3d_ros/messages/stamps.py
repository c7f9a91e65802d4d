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


def seconds_text(ns: int) -> str:
    """Return a time in nanoseconds as seconds with nine decimals, exactly.

    >>> seconds_text(1_500_000_001)
    '1.500000001'
    """
    sign, size = ("-" if ns < 0 else ""), abs(ns)
    return f"{sign}{size // SECOND}.{size % SECOND:09d}"


def nanoseconds_of_text(text: str) -> int | None:
    """Read a text that `seconds_text` has written, and return the time (ns); return None for any other text.

    A time after the year 2286 also gives None, because more than 10 digits precede the point.
    """
    whole, point, decimals = text.removeprefix("-").partition(".")
    if not (whole.isascii() and whole.isdigit() and point and decimals.isascii() and decimals.isdigit()):
        return None
    if len(decimals) != 9 or len(whole) > 10:
        return None
    size = int(whole) * SECOND + int(decimals)
    return -size if text.startswith("-") else size
