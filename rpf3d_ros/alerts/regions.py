"""The region of a message: the wall, or the part of a wall, that its sources belong to."""

Place = tuple[str | float, ...]
"""The place of a source: (topic, column, row) of a square in plan, or (topic, x, y, z) m of a clicked point.

A message without sources has the place (topic,), and so has each message of a sensor if the site file states its scan
period. All places that a topic no longer reports have the place (UNREPORTED, topic).
"""
UNREPORTED = "unreported"
Region = frozenset[Place]
"""The set of the places of all sources of one message."""


def unreported_region(topic: str) -> Region:
    """Return the region of the places that a topic no longer reports."""
    return frozenset({(UNREPORTED, topic)})
