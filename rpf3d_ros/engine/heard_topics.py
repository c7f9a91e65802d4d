"""Which topics have told of sources: one that then says nothing more must not go unseen because others speak."""

from rpf3d_core.alerts.times import span

BY_HAND = "/clicked_point"
"""Who clicks a source watches no wall, and has no more to say of it."""


def is_cleared_by(empty: str, told: str) -> bool:
    """Whether "nothing seen" on one topic says anything of what another has told: of its own, and of what was clicked.

    >>> is_cleared_by("sources", "sources"), is_cleared_by("sources", "source_cloud"), is_cleared_by("sources", BY_HAND)
    (True, False, True)
    """
    return told in (empty, BY_HAND)


class HeardTopics:
    """What each topic of sources has said last."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, bool]] = {}

    def note(self, topic: str, stamp_ns: int, sources: int) -> None:
        """A message of a stamp (ns) with so many sources is decided on; one answered anew is no news of its topic."""
        if topic != BY_HAND and stamp_ns >= self._last.get(topic, (stamp_ns, False))[0]:
            self._last[topic] = stamp_ns, sources > 0

    def silent(self, oldest_ns: int, now_ns: int) -> tuple[str, ...]:
        """A sentence for each topic that told of sources before a time (ns), and of nothing since."""
        return tuple(
            f"nothing has been heard of sources on {topic} for {span(max(now_ns - stamp, 0))}"
            for topic, (stamp, had_sources) in self._last.items()
            if had_sources and stamp < oldest_ns
        )

    def clear(self) -> None:
        """Forget them all: stamps mean nothing any more, or nobody has listened meanwhile."""
        self._last.clear()
