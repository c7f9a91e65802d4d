"""Remember the published answers, so that the first stages of a repeated answer do not replace a better answer."""

from collections.abc import Mapping
from typing import NamedTuple

from rpf3d_core.live.standing import Outlines
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.answered_sources import AnsweredSources


class PublishedAnswer(NamedTuple):
    """An answer that was published over the terrain in use: its sources, its areas and its number of rocks."""

    trigger: Trigger
    areas: Mapping[str, Outlines]
    rocks: int


class PublishedAnswers:
    """The answers that were published over the terrain in use."""

    def __init__(self, answered: AnsweredSources) -> None:
        self._answered = answered
        self._published: list[PublishedAnswer] = []

    def note(self, trigger: Trigger, areas: Mapping[str, Outlines], rocks: int) -> bool:
        """Note an answer before it is published; return False if it must not be published.

        An answer must not be published if an answer to the same trigger, with the same live areas and more rocks, was
        already published: the first stage of a repeated answer has few rocks.

        areas : the live areas of each topic; rocks : number of rocks of the answer
        """
        published = self._published
        if any(each.trigger is trigger and each.areas is areas and each.rocks > rocks for each in published):
            return False
        others = (each for each in published if each.trigger is not trigger and self._answered.holds(each.trigger))
        self._published = [*others, PublishedAnswer(trigger=trigger, areas=areas, rocks=rocks)]
        return True

    def clear(self) -> None:
        """Forget all published answers, because the terrain has changed or the answers' stamps are no longer valid."""
        self._published = []
