"""The faults of a terrain that lacks a patch or survey: written as sentences, and read from them after a restart."""

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from rpf3d_core.live.ground import LiveTerrain
from rpf3d_ros.engine.survey_in_use import patches_in

PATCHES = "{} patches are not in the terrain: the whole terrain must be published"
SURVEY = "a survey was refused ({}): the terrain is out of date, publish the whole terrain"


NOT_STORED = "the survey in use before the start is not in the store"


class TerrainLack(NamedTuple):
    """The patches and the whole survey that a terrain lacks.

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
    """Facts about the terrain before a restart, to notice a late whole survey that lacks a patch of this terrain.

    read_ns : time when the store was read, by the machine's clock (ns)
    patches_ns : times when the patches in the restored terrain were received, by the machine's clock (ns)
    stamps_ns : stamps (ns) of these patches; empty if they are not known
    unread : number of stored patches that cannot be read
    unreadable : why the stored terrain cannot be read; "" if the terrain can be read, or if no terrain is stored
    """

    read_ns: int = 0
    patches_ns: tuple[int, ...] = ()
    stamps_ns: tuple[int, ...] = ()
    unread: int = 0
    unreadable: str = ""


def lack_of(faults: Iterable[str]) -> TerrainLack:
    """Return what the terrain lacks, read from the sentences of the faults of an alert.

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


def terrain_to_remember(ground: LiveTerrain | None, memory: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts about the terrain to save for the next start, as plain values by name.

    The facts are the number of patches, the digest of the terrain, and the digest and stamp (ns) of its whole survey.

    ground : the terrain in use; None if there is none: then the facts in `memory` are returned
    memory : the facts that were saved before this start
    """
    if ground is None:
        return {key: memory[key] for key in ("patches", "terrain", "whole", "whole_ns") if key in memory}
    whole = {"whole": ground.whole_digest, "whole_ns": ground.whole_ns}
    return {"patches": patches_in(ground), "terrain": ground.digest, **whole}


def not_restored(memory: Mapping[str, Any], ground: LiveTerrain | None, unread: int) -> TerrainLack:
    """Return the patches and survey that the terrain had before the start, and that the restored terrain lacks.

    Without a store, all patches are missing. With a store, surveys and patches may be missing that were not written
    before the node was killed. The digests show this. The numbers of patches do not show it, because a store counts
    from 0 again at each whole terrain that it writes. If the digests differ and no stored patch is unreadable, at least
    one patch counts as missing. This also applies if the restored terrain is newer than `memory`, which can happen with
    messages of the last second before a kill.

    memory : from `terrain_to_remember`; ground : the restored terrain; None if there is none
    unread : number of stored patches that cannot be read
    """
    digest, missing = memory.get("terrain"), int(memory.get("patches", 0)) - unread
    if ground is None or digest is None:
        return TerrainLack(max(missing - (0 if ground is None else ground.patches), 0))
    if digest == ground.digest:
        return TerrainLack()
    if int(memory.get("whole_ns", 0)) > ground.whole_ns:
        return TerrainLack(why_refused=NOT_STORED)
    return TerrainLack(max(missing - ground.patches, 0 if unread else 1))
