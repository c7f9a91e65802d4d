"""What several walls' answers say together: the worst of each, so that news from one wall never hides another's."""

import hashlib
from collections.abc import Iterator, Sequence

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.ensemble.statistics import wilson_interval


def together(parts: Sequence[Evidence]) -> Evidence:
    """One evidence of at least one, the newest last: the worst that any says of each area that is watched.

    Watched are the areas that the newest tells of, which has any: one without an answer hides none. It is as uncertain
    as that of the fewest rocks, and as old as the oldest trigger and the oldest survey: shares are told as so many of
    the fewest flown, rounded up. What else there is, is the newest's.
    """
    newest = parts[-1]
    if len(parts) == 1:
        return newest
    watched = next((part.areas for part in reversed(parts) if part.areas), ())
    flown = min((area.flown for part in parts for area in part.areas), default=0)
    digests = hashlib.sha256(" ".join(part.sources_digest for part in parts).encode()).hexdigest()
    return newest._replace(
        trigger_stamp_ns=min(part.trigger_stamp_ns for part in parts),
        terrain_stamp_ns=min(part.terrain_stamp_ns for part in parts),
        sources_digest=digests,
        sources=sum(part.sources for part in parts),
        areas=tuple(_worst(list(_told(parts, area.name)), flown) for area in watched),
        faults=tuple(dict.fromkeys(fault for part in parts for fault in part.faults)),
        unfinished=max(_scaled(part.unfinished, _flown(part), flown) for part in parts),
    )


def _told(parts: Sequence[Evidence], name: str) -> Iterator[AreaEvidence]:
    """What each tells of an area; one that was not watched for an answer is not in it."""
    return (area for part in parts for area in part.areas if area.name == name)


def _flown(part: Evidence) -> int:
    return max((area.flown for area in part.areas), default=0)


def _worst(said: list[AreaEvidence], flown: int) -> AreaEvidence:
    """The worst of what several answers say of an area, of so many rocks."""
    reached = max(_scaled(area.reached, area.flown, flown) for area in said)
    low, high = wilson_interval(reached, max(flown, 1))
    p95 = [energy for area in said if (energy := _p95_or_largest(area)) is not None]
    largest = [area.largest_energy for area in said if area.largest_energy is not None]
    first = [area.first_arrival_s for area in said if area.first_arrival_s is not None]
    has_p95 = any(area.p95_energy is not None for area in said)
    known = (max(p95, default=None) if has_p95 else None, max(largest, default=None), min(first, default=None))
    return AreaEvidence(said[0].name, flown, reached, low, high, *known)


def _p95_or_largest(area: AreaEvidence) -> float | None:
    """What is compared with a limit of energy: where too few rocks came for a percentile, the largest stands for it."""
    return area.largest_energy if area.p95_energy is None else area.p95_energy


def _scaled(count: int, of: int, to: int) -> int:
    """A count out of some number as one out of another, rounded up."""
    return -(-count * to // of) if of else 0
