"""Convert times: whole nanoseconds in code, seconds and UTC dates in sentences."""

from datetime import UTC, datetime, timedelta

NS = 1_000_000_000
"""Nanoseconds in a second."""

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def ns_of(seconds: float) -> int:
    """Return seconds of a site file as whole nanoseconds."""
    return round(seconds * NS)


def span(ns: int) -> str:
    """Format a period >= 0 (ns) in seconds, to the millisecond."""
    return f"{ns // NS}.{ns % NS // 1_000_000:03d} s"


def when(ns: int) -> str:
    """Format a time (ns) as UTC, to the millisecond; as plain seconds if it is outside the calendar."""
    try:
        moment = EPOCH + timedelta(seconds=ns // NS)
    except (OverflowError, ValueError):
        return f"{ns // NS} s"
    return f"{moment:%Y-%m-%d %H:%M:%S}.{ns % NS // 1_000_000:03d} UTC"
