"""Record the current and the former outlines of areas of interest, to find evidence made for a former outline."""

import hashlib
import threading
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain

import numpy as np

from rpf3d_core.alerts.evidence import Evidence, Outdated
from rpf3d_core.terrain.frame import FloatArray

REMEMBERED = 10_000
"""Largest number of digests, including the current digest, that are remembered for each area, and for the terrain.

A digest that is no longer remembered counts as replaced when the history began: evidence with this digest then causes a
fault immediately, which is safer than no fault.
"""

FORMER_AREAS = 1000
"""Largest number of removed areas whose outlines are remembered; the area that was removed first is forgotten first."""

REMOVED = ""
"""Digest of an area that is not watched, as in evidence without this area."""


def outline_digest(rings: Iterable[FloatArray]) -> str:
    """Return a digest (SHA-256, hex) that identifies the outline of an area by its rings (P, 2) m, map frame."""
    digest = hashlib.sha256(b"outline")
    for ring in rings:
        digest.update(f" {len(ring)} ".encode())
        digest.update(np.ascontiguousarray(ring, dtype="<f8").tobytes())
    return digest.hexdigest()


class DigestHistory:
    """The current and the former digests of a thing that changes, such as the outline of an area or the terrain."""

    def __init__(self, digest: str, now_ns: int) -> None:
        """Start the history with a digest that is current from `now_ns` (ns) on."""
        self._digests, self._since_ns = [digest], [now_ns]
        self._counts = Counter(self._digests)
        self._began_ns = now_ns

    @property
    def present(self) -> str:
        """The current digest."""
        return self._digests[-1]

    @property
    def since_ns(self) -> int:
        """Time (ns) at which the current digest replaced the previous digest, or at which the history began."""
        return self._since_ns[-1]

    def watch(self, digest: str, now_ns: int) -> None:
        """Make a digest the current digest from `now_ns` (ns) on; the digest before it becomes a former digest.

        Do nothing if the digest is already the current digest. At most REMEMBERED digests are kept.
        """
        if digest == self.present:
            return
        self._digests.append(digest)
        self._since_ns.append(now_ns)
        self._counts[digest] += 1
        if len(self._digests) > REMEMBERED:
            del self._since_ns[0]
            forgotten = self._digests.pop(0)
            self._counts[forgotten] -= 1
            if not self._counts[forgotten]:
                del self._counts[forgotten]

    def replaced_ns(self, digest: str, made_ns: int) -> int | None:
        """Return the time (ns) at which a digest was replaced; None if it is the current digest.

        If the digest was current in several periods, the last period that began at or before `made_ns` counts. If every
        period began later, the first period counts. So evidence never counts as younger than its rocks, even if an
        outline changes back and forth. An unknown digest counts as replaced at the beginning of the history.

        made_ns : when (ns) the evidence with this digest was made
        """
        if digest == self.present:
            return None
        if digest not in self._counts:
            return self._began_ns
        place = bisect_right(self._since_ns, made_ns)
        nearest = chain(reversed(range(place)), range(place, len(self._digests)))
        return next(self._since_ns[index + 1] for index in nearest if self._digests[index] == digest)


class WatchedOutlines:
    """The current and the former outlines of each watched area. Any thread may call the methods."""

    def __init__(self) -> None:
        self._known: dict[str, DigestHistory] = {}
        self._removed: dict[str, DigestHistory] = {}
        self._lock = threading.Lock()

    def watch(self, digests: Mapping[str, str], now_ns: int) -> None:
        """Replace the watched areas by the given areas; new and changed outlines are current from `now_ns` (ns) on.

        An unchanged outline keeps the time since which it is current. The history of a removed area is kept, and
        continues if the area is added again. So if an area is removed and added repeatedly, its outline counts as
        replaced from the first change that no answer includes.

        digests : for each area, by name, the digest of its outline
        """
        with self._lock:
            before, self._known = self._known, {}
            for name, digest in digests.items():
                known = before.pop(name, None) or self._removed.pop(name, None) or DigestHistory(REMOVED, now_ns)
                known.watch(digest, now_ns)
                self._known[name] = known
            for name, known in before.items():
                known.watch(REMOVED, now_ns)
                self._removed[name] = known
            while len(self._removed) > FORMER_AREAS:
                del self._removed[next(iter(self._removed))]

    def restart(self, now_ns: int) -> None:
        """Forget all former outlines; the current outlines count as current from `now_ns` (ns) on.

        Call this if earlier times are no longer valid, for example because the clock was set back.
        """
        with self._lock:
            self._removed = {}
            self._known = {name: DigestHistory(known.present, now_ns) for name, known in self._known.items()}

    def described(self, evidence: Evidence) -> Evidence:
        """Return the evidence with `outlined_ns` set for each area: the time (ns) since which its outline is current.

        `outlined_ns` is 0 for an area that is not watched.
        """
        with self._lock:
            since = {name: known.since_ns for name, known in self._known.items()}
        return evidence._replace(
            areas=tuple(area._replace(outlined_ns=since.get(area.name, 0)) for area in evidence.areas)
        )

    def outdated(self, parts: Sequence[Evidence]) -> tuple[Outdated, ...]:
        """Return the watched areas for which a part of the evidence used a former outline or none, and since when (ns).

        "Since when" is the time at which the outline in a part of the evidence was replaced; of several parts, the
        earliest time.

        parts : the evidence of each wall. A part without areas but with a fault is skipped: its sources have no answer,
            and this is the fault. A part without areas or faults was answered before there was an area
        """
        found: dict[str, int] = {}
        with self._lock:
            for part in parts:
                shown = {area.name: area.outline for area in part.areas}
                for name, known in self._known.items() if shown or not part.faults else ():
                    since_ns = known.replaced_ns(shown.get(name, REMOVED), part.at_ns)
                    if since_ns is not None:
                        found[name] = min(since_ns, found.get(name, since_ns))
        return tuple(Outdated(name=name, since_ns=since_ns) for name, since_ns in found.items())
