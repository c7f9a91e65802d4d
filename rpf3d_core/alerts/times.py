"""Times are whole nanoseconds; in sentences they are seconds, and dates in UTC."""

from datetime import UTC, datetime, timedelta

NS = 1_000_000_000
"""ns of a second."""

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def ns_of(seconds: float) -> int:
    """Seconds of a site file as whole nanoseconds."""
    return round(seconds * NS)


def span(ns: int) -> str:
    """A period >= 0 in words, to the millisecond."""
    return f"{ns // NS}.{ns % NS // 1_000_000:03d} s"


def when(ns: int) -> str:
    """A point in time as UTC to the millisecond; as plain seconds where no calendar reaches."""
    try:
        moment = EPOCH + timedelta(seconds=ns // NS)
    except (OverflowError, ValueError):
        return f"{ns // NS} s"
    return f"{moment:%Y-%m-%d %H:%M:%S}.{ns % NS // 1_000_000:03d} UTC"
