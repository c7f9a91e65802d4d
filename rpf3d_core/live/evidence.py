"""What several walls' answers say together: the worst of each, so that news from one wall never hides another's."""

import hashlib
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence

N = TypeVar("N", int, float)


def together(parts: Sequence[Evidence]) -> Evidence:
    """One evidence of at least one, the newest last: the worst that any says of each area, limit by limit.

    What is not of areas is the newest's, but for the sources and their digests, which are of all, and the stamp of the
    trigger, which is the oldest's: together they are as old as that.
    """
    newest = parts[-1]
    if len(parts) == 1:
        return newest
    names = dict.fromkeys(area.name for part in parts for area in part.areas)
    areas = tuple(_worst([area for part in parts for area in part.areas if area.name == name]) for name in names)
    digests = hashlib.sha256(" ".join(part.sources_digest for part in parts).encode()).hexdigest()
    return newest._replace(
        trigger_stamp_ns=min(part.trigger_stamp_ns for part in parts),
        sources_digest=digests,
        sources=sum(part.sources for part in parts),
        areas=areas,
        faults=tuple(dict.fromkeys(fault for part in parts for fault in part.faults)),
        unfinished=max(part.unfinished for part in parts),
    )


def _worst(said: list[AreaEvidence]) -> AreaEvidence:
    """The worst of what several answers say of an area; of the fewest rocks, for it is as uncertain as the least."""
    first = said[0]
    return AreaEvidence(
        name=first.name,
        flown=min(area.flown for area in said),
        reached=max(min(area.reached, min(a.flown for a in said)) for area in said),
        low=max(area.low for area in said),
        high=max(area.high for area in said),
        p95_energy=_of_known(max, (area.p95_energy for area in said)),
        largest_energy=_of_known(max, (area.largest_energy for area in said)),
        first_arrival_s=_of_known(min, (area.first_arrival_s for area in said)),
    )


def _of_known(choose: Callable[[Iterable[float]], float], values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return choose(known) if known else None
