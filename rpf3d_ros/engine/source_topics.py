"""Notice topics of sources that fall silent: their last message reported sources, and no message follows."""

from rpf3d_core.alerts.times import span

BY_HAND = "/clicked_point"
"""Topic of clicked sources: a click by a person is a single event, so no further message is expected."""


def is_cleared_by(empty: str, reported: str) -> bool:
    """True if a message without sources on topic `empty` ends a report of topic `reported`.

    A topic ends its own reports, and reports of clicked sources.

    >>> is_cleared_by("sources", "sources"), is_cleared_by("sources", "source_cloud"), is_cleared_by("sources", BY_HAND)
    (True, False, True)
    """
    return reported in (empty, BY_HAND)


class SourceTopics:
    """The last message of each topic of sources: its stamp, and whether it reported any source."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, bool]] = {}

    def note(self, topic: str, stamp_ns: int, sources: int) -> None:
        """Note the stamp (ns) and number of sources of a message.

        A message that is answered again is not newer than the last message of its topic, so the call changes nothing.
        """
        if topic != BY_HAND and stamp_ns >= self._last.get(topic, (stamp_ns, False))[0]:
            self._last[topic] = stamp_ns, sources > 0

    def silent(self, oldest_ns: int, now_ns: int) -> tuple[str, ...]:
        """Return a sentence for each topic that has fallen silent: its last message had sources and is too old."""
        return tuple(
            f"nothing has been heard of sources on {topic} for {span(max(now_ns - stamp, 0))}"
            for topic, (stamp, had_sources) in self._last.items()
            if had_sources and stamp < oldest_ns
        )

    def clear(self) -> None:
        """Forget all topics, because the stamps are invalid or the node was not subscribed meanwhile."""
        self._last.clear()
