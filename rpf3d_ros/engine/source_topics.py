"""Notice topics of sources, that is sensors, that fall silent: what happens in their view is then unknown."""

from collections.abc import Sequence

from rpf3d_core.alerts.times import span

BY_HAND = "clicked_point"
"""Topic of clicked sources: a click by a person is a single event, so no further message is expected."""


class SourceTopics:
    """The stamp of the last message of each topic of sources; every topic that has published must go on publishing.

    expected : topics that must publish even if they have never published
    """

    def __init__(self, expected: Sequence[str] = ()) -> None:
        self._expected = tuple(expected)
        self._last: dict[str, int] = {}
        self._heard: dict[str, int] = {}

    def note(self, topic: str, stamp_ns: int) -> None:
        """Note the stamp (ns) of a message, with or without sources.

        A message that is answered again is not newer than the last message of its topic, so the call changes nothing.
        """
        if topic != BY_HAND:
            self._last[topic] = max(stamp_ns, self._last.get(topic, stamp_ns))

    def silent(self, oldest_ns: int, now_ns: int) -> tuple[str, ...]:
        """Return a sentence for each topic that is silent: its last message is too old, or it is expected."""
        fell_silent = tuple(
            f"nothing has been heard of sources on {topic} for {span(max(now_ns - stamp, 0))}"
            for topic, stamp in self._last.items()
            if stamp < oldest_ns
        )
        never = [topic for topic in self._expected if topic not in self._last]
        again = [topic for topic in self._heard if topic not in (*self._last, *never)]
        return (
            *fell_silent,
            *(f"nothing has been heard of sources on {topic} (expected_topics)" for topic in never),
            *(f"nothing has been heard of sources on {topic} since stamps were forgotten" for topic in again),
        )

    def clear(self) -> None:
        """Forget all stamps, because they are invalid or the node was not subscribed meanwhile.

        The topics must then publish again: a sensor that fell silent before is not back because the clock went back.
        """
        self._heard.update(self._last)
        self._last.clear()
