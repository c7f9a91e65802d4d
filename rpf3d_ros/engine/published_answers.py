"""Remember which answers were published, so that an answer that begins again does not replace a better one."""

from collections.abc import Mapping
from typing import NamedTuple

from rpf3d_core.live.standing import Outlines
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.answered_sources import AnsweredSources


class PublishedAnswer(NamedTuple):
    """What has been published for a trigger over the present ground: for which areas, and of how many rocks."""

    trigger: Trigger
    areas: Mapping[str, Outlines]
    rocks: int


class PublishedAnswers:
    """The answers published over the present ground."""

    def __init__(self, answered: AnsweredSources) -> None:
        self._answered = answered
        self._published: list[PublishedAnswer] = []

    def note(self, trigger: Trigger, areas: Mapping[str, Outlines], rocks: int) -> bool:
        """Note an answer; return False if an answer with more rocks was published for the same trigger and areas.

        An answer that begins again begins with few rocks.
        """
        published = self._published
        if any(each.trigger is trigger and each.areas is areas and each.rocks > rocks for each in published):
            return False
        others = (each for each in published if each.trigger is not trigger and self._answered.holds(each.trigger))
        self._published = [*others, PublishedAnswer(trigger=trigger, areas=areas, rocks=rocks)]
        return True

    def clear(self) -> None:
        """Forget all answers, because the ground has changed or their stamps are no longer valid."""
        self._published = []
