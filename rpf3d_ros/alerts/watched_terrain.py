"""Notice answers that were flown over a former terrain, and still count long after the terrain has changed."""

import threading
from collections.abc import Sequence

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.time_units import ns_of, span
from rpf3d_core.live.outlines import DigestHistory


class WatchedTerrain:
    """The current terrain and its former states. Any thread may call.

    After a change, the sources of each region are answered again, unless there are too many regions or the answers take
    too long. The evidence of a region over the former terrain may then lack danger on the current terrain.
    """

    def __init__(self, longest_s: float) -> None:
        """Begin without terrain.

        longest_s : longest time (s) for which an answer may count after its terrain was replaced, without a fault
        """
        self._longest_s, self._longest_ns = longest_s, ns_of(longest_s)
        self._known: DigestHistory | None = None
        self._lock = threading.Lock()

    def watch(self, digest: str, now_ns: int) -> None:
        """Set the current terrain; digest : digest of the terrain, "" without terrain; now_ns : current time (ns)."""
        with self._lock:
            if self._known is None:
                self._known = DigestHistory(digest, now_ns)
            self._known.watch(digest, now_ns)

    def restart(self, now_ns: int) -> None:
        """Forget all former terrains, because times before now (ns) are not valid; the current terrain stays."""
        with self._lock:
            self._known = None if self._known is None else DigestHistory(self._known.present, now_ns)

    def faults(self, parts: Sequence[Evidence], now_ns: int) -> tuple[str, ...]:
        """Return the fault of answers that count too long after their terrain was replaced: one sentence, or none.

        parts : the evidence of each region; now_ns : current time (ns)
        """
        ages = [now_ns - since_ns for since_ns in self._replaced_ns(parts)]
        late = [age for age in ages if age >= self._longest_ns]
        if not late:
            return ()
        return (
            f"the terrain changed {span(max(late))} ago, and sources of {len(late)} regions are not yet simulated on "
            f"it (at most {self._longest_s:g} s are allowed): they are simulated when their sensors report again; if "
            "every patch causes this, publish patches less often or raise evidence.changed_terrain_s of the site file",
        )

    def ends_ns(self, parts: Sequence[Evidence]) -> list[int]:
        """Return the times (ns) at which answers over a former terrain become a fault; parts as in `faults`."""
        return [since_ns + self._longest_ns for since_ns in self._replaced_ns(parts)]

    def _replaced_ns(self, parts: Sequence[Evidence]) -> list[int]:
        """Return, for each answer over a former terrain, the time (ns) at which this terrain was replaced.

        Evidence without areas is skipped: its sources have no answer, which is a separate fault.
        """
        with self._lock:
            if self._known is None:
                return []
            answered = [part for part in parts if part.areas]
            replaced = [self._known.replaced_ns(part.terrain_digest, part.at_ns) for part in answered]
        return [since_ns for since_ns in replaced if since_ns is not None]
