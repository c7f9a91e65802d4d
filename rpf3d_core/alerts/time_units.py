"""Convert times of alerts: code uses whole nanoseconds, sentences use seconds and UTC dates."""

from datetime import UTC, datetime, timedelta

NS = 1_000_000_000
"""Nanoseconds in a second."""

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def ns_of(seconds: float) -> int:
    """Return a period (s), such as one of the site file, in whole nanoseconds, the unit of all times in decisions."""
    return round(seconds * NS)


def span(ns: int) -> str:
    """Return a period >= 0 (ns) as text for a sentence: seconds, to the millisecond."""
    return f"{ns // NS}.{ns % NS // 1_000_000:03d} s"


def when(ns: int) -> str:
    """Return a time (ns) as text for a sentence: UTC to the millisecond, or plain seconds outside the calendar."""
    try:
        moment = EPOCH + timedelta(seconds=ns // NS)
    except (OverflowError, ValueError):
        return f"{ns // NS} s"
    return f"{moment:%Y-%m-%d %H:%M:%S}.{ns % NS // 1_000_000:03d} UTC"
