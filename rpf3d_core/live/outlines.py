"""The present outline of each area of interest, and which evidence was made for a former outline of an area."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rpf3d_core.alerts.evidence import Evidence, Outdated
from rpf3d_core.terrain.frame import FloatArray

REMEMBERED = 100
"""Largest number of outlines remembered for each area.

A forgotten outline counts as replaced at the time when the oldest remembered outline began.
"""


def outline_digest(rings: Iterable[FloatArray]) -> str:
    """Return a digest (SHA-256, hex) that identifies the outline of an area by its rings (P, 2) m, map frame."""
    digest = hashlib.sha256(b"outline")
    for ring in rings:
        digest.update(f" {len(ring)} ".encode())
        digest.update(np.ascontiguousarray(ring, dtype="<f8").tobytes())
    return digest.hexdigest()


class KnownOutline(NamedTuple):
    """An outline of an area: its digest, and the time (ns) since when it is watched."""

    digest: str
    since_ns: int


class WatchedOutlines:
    """The outlines of all watched areas: the present and the former outlines of each."""

    def __init__(self) -> None:
        self._known: dict[str, list[KnownOutline]] = {}

    def watch(self, digests: Mapping[str, str], now_ns: int) -> None:
        """Watch these areas, and no others, from now (ns) on; an outline that is watched already keeps its time.

        digests : for each area, by name, the digest of its outline
        """
        known = {name: self._known.get(name, []) for name in digests}
        for name, digest in digests.items():
            if not known[name] or known[name][-1].digest != digest:
                known[name] = [*known[name], KnownOutline(digest, now_ns)][-REMEMBERED:]
        self._known = known

    def restart(self, now_ns: int) -> None:
        """Forget all former outlines, and watch the present outlines from now (ns) on: earlier times are not valid."""
        present = {name: known[-1].digest for name, known in self._known.items()}
        self._known = {}
        self.watch(present, now_ns)

    def described(self, evidence: Evidence) -> Evidence:
        """Return the evidence with `outlined_ns` set for each area: since when its present outline is watched."""
        since = {name: known[-1].since_ns for name, known in self._known.items()}
        return evidence._replace(
            areas=tuple(area._replace(outlined_ns=since.get(area.name, 0)) for area in evidence.areas)
        )

    def outdated(self, parts: Sequence[Evidence]) -> tuple[Outdated, ...]:
        """Return each watched area whose present outline is missing in a part of the evidence, and when the area moved.

        parts : the evidence of each wall. A part without areas is skipped: its sources have no answer, and the missing
            answer is a separate fault
        """
        found: dict[str, int] = {}
        for part in parts:
            shown = {area.name: area.outline for area in part.areas}
            for name in self._known if shown else ():
                since_ns = self._replaced_ns(name, shown.get(name, ""))
                if since_ns is not None:
                    found[name] = min(since_ns, found.get(name, since_ns))
        return tuple(Outdated(name=name, since_ns=since_ns) for name, since_ns in found.items())

    def _replaced_ns(self, name: str, digest: str) -> int | None:
        """Return when (ns) an outline of an area was replaced; None if the outline is the present one.

        digest : digest of the outline, "" if the evidence lacks the area. For an outline that is not remembered, the
            result is the time from which the oldest remembered outline has been watched
        """
        known = self._known[name]
        if known[-1].digest == digest:
            return None
        replaced = [after.since_ns for before, after in pairwise(known) if before.digest == digest]
        return replaced[-1] if replaced else known[0].since_ns
