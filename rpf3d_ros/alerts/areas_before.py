"""Faults of topics that defined an area of interest before a restart or a pause of the node.

Until such a topic publishes again, its area is unknown.
"""

from collections.abc import Callable, Iterable

CAUSE = "area: {}"
"""Name of the cause of a standing fault; the topic replaces the braces."""


class AreasBefore:
    """The topics that define an area now, and the silent topics.

    A silent topic defined an area before a restart or pause of the node, and has not published again since.

    Only one thread may call `announce`, `interrupted` and `received`.

    report : called with the cause and the sentence of each fault; an empty sentence ends the fault
    """

    def __init__(self, report: Callable[[str, str], None], before: Iterable[str]) -> None:
        """Begin with the topics that had an area before the restart (`before`): all must publish again."""
        self._report = report
        self._missing = frozenset(before)
        self._defined: frozenset[str] = frozenset()

    def repeat(self) -> None:
        """Report the fault of each silent topic; call this as soon as `report` can take faults."""
        for topic in sorted(self._missing):
            self._report(
                CAUSE.format(topic),
                f"nothing has been received on {topic} since the start of the node or its last activation, but this "
                "topic had an area before: publish the area again (an empty message if there is none)",
            )

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that define an area now and the silent topics, sorted. Any thread may call.

        After the next restart, all of these topics must publish their areas again.
        """
        return tuple(sorted(self._missing | self._defined))

    def interrupted(self, watched: Iterable[str]) -> None:
        """Note that messages may have been missed, and report a fault for each topic that must publish its area again.

        These are the watched topics that define an area, and the topics that were silent already.

        watched : topics whose areas have limits; the areas of other topics are not watched
        """
        self._missing |= self._defined & frozenset(watched)
        self.repeat()

    def announce(self, topic: str) -> None:
        """Note that a topic defines an area; call this before the area is used, so that `topics` contains the topic."""
        self._defined = self._defined | {topic}

    def received(self, topic: str, has_area: bool) -> None:
        """Note a valid message of a topic, which ends its fault; has_area : False if the topic now defines no area."""
        self._defined = self._defined | {topic} if has_area else self._defined - {topic}
        if topic in self._missing:
            self._missing = self._missing - {topic}
            self._report(CAUSE.format(topic), "")
