"""What an answer of the simulator says of the areas of interest, in plain numbers that JSON can hold."""

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.values import Outcome

UNFINISHED = (
    Outcome.MAX_TIME, Outcome.MAX_IMPACTS, Outcome.UNRESOLVED_CONTACT, Outcome.FAILED, Outcome.LOST_TO_HOLE,
    Outcome.FELL_THROUGH,
)  # fmt: skip
"""Rocks that ended so might have gone on, into an area that they are not counted in."""


class AreaEvidence(NamedTuple):
    """What came to an area.

    flown : rocks flown in all; reached : those that came to the area
    low, high : the 95 % Wilson interval of the share that did (-); both 0 where nothing flew, for there was no source
    p95_energy : J, of each rock's maximum in the area; None where too few came for a percentile
    largest_energy : J; first_arrival : s from its release until the fastest rock came; None where none came
    """

    name: str
    flown: int
    reached: int
    low: float
    high: float
    p95_energy: float | None
    largest_energy: float | None
    first_arrival_s: float | None


class Evidence(NamedTuple):
    """One answer: what it was made from, and what it says of each area.

    result, stage : number of the answer, and how often it has been refined
    at_ns : when it was made; trigger_stamp_ns, terrain_stamp_ns : stamps of the sources and of the survey
    terrain_digest, sources_digest : of the inputs
    sources : how many there are, 0 where the monitoring watches and sees none
    areas : where several answers are put together, an area may stand there once for each: the worst counts
    faults : sentences from whoever made it, each a reason not to believe it
    unfinished : rocks whose flight was cut off (`unfinished_of`)
    """

    result: int
    stage: int
    at_ns: int
    trigger_stamp_ns: int
    terrain_stamp_ns: int
    terrain_digest: str
    sources_digest: str
    sources: int
    seed: int
    version: str
    areas: tuple[AreaEvidence, ...]
    faults: tuple[str, ...] = ()
    unfinished: int = 0


def evidence_of(
    maps: HazardMaps, *, result: int, stage: int, at_ns: int, trigger_stamp_ns: int, terrain_stamp_ns: int,
    terrain_digest: str, sources_digest: str, sources: int, seed: int, version: str, unfinished: int = 0,
    faults: tuple[str, ...] = (),
) -> Evidence:  # fmt: skip
    """The evidence of an answer with `sources` of at least 1, from its maps; the facts are those of `Evidence`."""
    return Evidence(
        result, stage, at_ns, trigger_stamp_ns, terrain_stamp_ns, terrain_digest, sources_digest, sources, seed,
        version, areas_of(maps), faults, unfinished,
    )  # fmt: skip


def areas_of(maps: HazardMaps) -> tuple[AreaEvidence, ...]:
    """What came to each area of interest of some maps, in their order; areas that nothing came to among them."""
    row_of = {int(cell): row for row, cell in enumerate(maps.areas.cell)}
    return tuple(
        _reached(name, maps, row_of[a]) if a in row_of else _missed(name, maps.flown)
        for a, name in enumerate(maps.area_names)
    )


def untouched(names: Iterable[str]) -> tuple[AreaEvidence, ...]:
    """The areas of an answer to a message of no sources: nothing flew, so nothing came."""
    return tuple(AreaEvidence(name, 0, 0, 0.0, 0.0, None, None, None) for name in names)


def unfinished_of(outcomes: Mapping[Outcome, int]) -> int:
    """How many of the rocks that ended in each way were cut off on theirs."""
    return sum(int(outcomes.get(outcome, 0)) for outcome in UNFINISHED)


def _missed(name: str, flown: int) -> AreaEvidence:
    return AreaEvidence(name, int(flown), 0, *wilson_interval(0, max(int(flown), 1)), None, None, None)


def _reached(name: str, maps: HazardMaps, row: int) -> AreaEvidence:
    """An area that rocks came to, in a row of the layers.

    The percentile is told as the most that its bin leaves open, never above the largest energy.
    """
    layers, flown = maps.areas, int(maps.flown)
    reached = int(layers.rocks[row])
    largest, p95 = float(layers.energy.largest[row]), _known(layers.energy.p95[row])
    told = None if p95 is None else min(p95 * (1.0 + layers.percentiles_within), largest)
    share = wilson_interval(reached, max(flown, 1, reached))
    return AreaEvidence(name, flown, reached, *share, told, largest, _known(layers.first_arrival[row]))


def _known(value: np.floating[Any]) -> float | None:
    """A number of a map, or None where the map knows none."""
    return None if math.isnan(value) else float(value)
