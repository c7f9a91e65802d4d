"""The faults of a terrain that lacks a patch or survey: written as sentences, and read from them after a restart."""

import re
from collections.abc import Iterable
from typing import NamedTuple

PATCHES = "{} patches are not in the terrain: the whole terrain must be published"
SURVEY = "a survey was refused ({}): the terrain is out of date, publish the whole terrain"


class TerrainLack(NamedTuple):
    """What a terrain lacks.

    patches : number of missing patches; why_refused : why a whole survey was refused, "" if none was refused
    """

    patches: int = 0
    why_refused: str = ""

    @property
    def patches_sentence(self) -> str:
        """The fault of missing patches; "" if none is missing."""
        return PATCHES.format(self.patches) if self.patches else ""

    @property
    def survey_sentence(self) -> str:
        """The fault of a refused survey; "" if none was refused."""
        return SURVEY.format(self.why_refused) if self.why_refused else ""


class TerrainBefore(NamedTuple):
    """What is known of the terrain before a restart, to notice a late whole survey that lacks a patch of this terrain.

    read_ns : time when the store was read, by the machine's clock (ns)
    patches_ns : times when the patches in the restored terrain were received, by the machine's clock (ns)
    unread : number of stored patches that cannot be read; unreadable : why no terrain can be read, "" if one can
    """

    read_ns: int = 0
    patches_ns: tuple[int, ...] = ()
    unread: int = 0
    unreadable: str = ""


def lack_of(faults: Iterable[str]) -> TerrainLack:
    """Return what the terrain lacks according to the faults of an alert, from their sentences.

    >>> lack_of(["2 patches are not in the terrain: the whole terrain must be published"])
    TerrainLack(patches=2, why_refused='')
    """
    patches, why = 0, ""
    for fault in faults:
        if found := re.fullmatch(_pattern(PATCHES), fault, re.DOTALL):
            patches = int(found[1]) if found[1].isdecimal() else 1
        if found := re.fullmatch(_pattern(SURVEY), fault, re.DOTALL):
            why = found[1]
    return TerrainLack(patches=patches, why_refused=why)


def _pattern(sentence: str) -> str:
    before, _, after = sentence.partition("{}")
    return f"{re.escape(before)}(.+){re.escape(after)}"
