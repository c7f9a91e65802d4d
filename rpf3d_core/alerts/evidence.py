"""The evidence of an answer: what its rocks did in the areas of interest, as numbers for the decision."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.alerts.origins import Origins
from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.maps import HazardMaps, Layers
from rpf3d_core.values import Outcome

LEFT = (Outcome.LEFT_TERRAIN, Outcome.LOST_TO_HOLE)
"""Outcomes of rocks that left the terrain, over its boundary or into a hole: it is unknown where such a rock went."""

UNFINISHED = (
    Outcome.MAX_TIME, Outcome.MAX_IMPACTS, Outcome.UNRESOLVED_CONTACT, Outcome.FAILED, Outcome.LOST_TO_HOLE,
    Outcome.FELL_THROUGH,
)  # fmt: skip
"""Outcomes of rocks whose flight was cut off: such a rock might still have reached an area."""


class AreaEvidence(NamedTuple):
    """Evidence of the rocks of one answer in one area: counts, energies and the first arrival.

    flown : number of all rocks flown; reached : number of rocks that reached the area. With several clusters of
        sources, `flown` is the smallest number of rocks that a cluster has flown, and `reached` is the number of the
        worst cluster, scaled to `flown` rocks
    low, high : 95 % Wilson interval of the share (-) of rocks that reached the area; both 0 if no rock flew, because
        there was no source
    p95_energy : J, 95th percentile of the largest energy of each rock in the area; None if too few rocks reached the
        area
    largest_energy : J; first_arrival_s : s, shortest time from the release of a rock to its arrival in the area; both
        None if no rock reached the area
    left : number of the flown rocks that left the terrain and might still have reached the area (`live.leaving`)
    without_energy : share (-) of the rocks in `left` among the rocks that are in `left` or reached the area, the
        largest of all clusters; 1 for a cluster without a p95 energy; None if it follows from the other figures
    uncovered : share (-) of the area in plan that has no terrain below it; larger if more than half of one of several
        outlines of the area has no terrain (`live.coverage`)
    clusters : number of clusters of sources; each figure is from the cluster with the worst figure; 0 if the sources
        were not divided into clusters
    pooled_flown, pooled_reached : numbers of rocks of all clusters together, for display only
    sets : number of parameter sets among which the rocks are shared out; 0 in a scene without unknowns
    predictive_low, predictive_high : 95 % predictive interval of the share (-) over the parameter sets; None in a
        scene without unknowns, and while too few rocks of each set have flown
    left_high : as `predictive_high`, if the rocks in `left` are counted as rocks that reached the area; computed set by
        set, because most of these rocks may belong to the few sets that decide the upper end
    energy_high : J, upper end of the predictive interval of the p95 energy over the parameter sets; the largest energy
        of all sets if fewer than 39 sets have a p95; never below `pooled_energy`
    energy_sets : number of parameter sets with enough rocks in the area for a p95 energy
    first_arrival_low_s : s, shortest first arrival of all parameter sets, never above `first_arrival_s`
    energy_high and first_arrival_low_s are None if `predictive_high` is None, and if no rock reached the area, not even
        on a path displaced by the misfit
    origins : the cluster of sources that gave each figure; None if no rock flew
    outline : digest of the outline within which the rocks were counted; "" if that is not known
    outlined_ns : time (ns) since which the area has its current outline; 0 if that is not known
    """

    name: str
    flown: int
    reached: int
    low: float
    high: float
    p95_energy: float | None
    largest_energy: float | None
    first_arrival_s: float | None
    left: int = 0
    uncovered: float = 0.0
    clusters: int = 0
    pooled_flown: int = 0
    pooled_reached: int = 0
    sets: int = 0
    predictive_low: float | None = None
    predictive_high: float | None = None
    left_high: float | None = None
    origins: Origins | None = None
    outline: str = ""
    outlined_ns: int = 0
    energy_high: float | None = None
    energy_sets: int = 0
    first_arrival_low_s: float | None = None
    without_energy: float | None = None

    @property
    def share_without_energy(self) -> float:
        """The largest share (-) of rocks with unknown energy that a cluster may have in the area, as `without_energy`.

        If `without_energy` is None, as in logs of older versions, the share follows from `left` and `reached`. The
        share is then 1 if rocks left the terrain and the area has no p95 energy.
        """
        if self.without_energy is not None or self.left <= 0:
            return self.without_energy or 0.0
        if self.p95_energy is None:
            return 1.0
        return self.left / (self.left + max(self.reached, 0))

    @property
    def pooled_energy(self) -> float | None:
        """The energy (J) of all rocks together that is compared with a limit: the p95 energy, else the largest energy.

        None if no rock reached the area.
        """
        return self.largest_energy if self.p95_energy is None else self.p95_energy


class Outdated(NamedTuple):
    """An area that has moved, while a part of the evidence still describes its former place.

    A part of the evidence is the answer to the sources of one wall.

    name : of the area; since_ns : time (ns) at which the area moved
    """

    name: str
    since_ns: int


class Evidence(NamedTuple):
    """The evidence of one answer, or of several combined: all that a decision knows about the inputs and the results.

    result, stage : number of the result (each stage of an answer has its own), and number of the stage, from 0
    at_ns : time of the answer; trigger_stamp_ns, terrain_stamp_ns : stamps of the sources and of the survey (all ns)
    terrain_digest, sources_digest : digests of the inputs
    sources : number of sources; 0 if the monitoring works and sees no source
    seed : random seed of the scene; version : version of rpf3d
    areas : if several answers are combined, an area may occur once for each answer: the highest level counts
    faults : sentences from the program that made the evidence, each a reason not to believe the evidence
    unfinished : number of rocks whose flight was cut off (`unfinished_of`); with several clusters or answers, the
        number of the worst cluster or answer, scaled to the cluster or answer with the fewest rocks
    outdated : areas that have moved and are not yet at their new place in the answers to all sources
    notes : sentences that the reader of the alert must know; the evidence is believed in spite of them
    complete_until_ns : time (ns) at which the program that combined the evidence would add a fault if it received
        nothing new, because a sensor would then be silent for too long, or an answer too old for the current terrain;
        0 if there is no such time
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
    outdated: tuple[Outdated, ...] = ()
    notes: tuple[str, ...] = ()
    complete_until_ns: int = 0


def areas_of(maps: HazardMaps) -> tuple[AreaEvidence, ...]:
    """Return the evidence of each area of interest from the maps of an answer, including areas that no rock reached."""
    return areas_in(maps.areas, maps.area_names, maps.flown)


def areas_in(layers: Layers, names: Sequence[str], flown: int) -> tuple[AreaEvidence, ...]:
    """Return the evidence of the areas with the given names, including areas that no rock reached.

    layers : map values, with one row for each area that rocks reached; flown : number of rocks flown
    names : of all areas of interest, in the order of their numbers in `layers.cell`
    """
    row_of = {int(cell): row for row, cell in enumerate(layers.cell)}
    return tuple(
        _reached(name, layers, row_of[a], int(flown)) if a in row_of else _missed(name, flown)
        for a, name in enumerate(names)
    )


def untouched(names: Iterable[str]) -> tuple[AreaEvidence, ...]:
    """Return the evidence of areas when the monitoring reports no sources: no rock flew, so no rock reached an area."""
    return tuple(
        AreaEvidence(
            name=name, flown=0, reached=0, low=0.0, high=0.0, p95_energy=None, largest_energy=None, first_arrival_s=None
        )
        for name in names
    )


def unfinished_of(outcomes: Mapping[Outcome, int]) -> int:
    """Return the number of rocks cut off in flight, which might have gone further, from the count of each outcome."""
    return sum(int(outcomes.get(outcome, 0)) for outcome in UNFINISHED)


def _missed(name: str, flown: int) -> AreaEvidence:
    """Return the evidence of an area that no rock reached: a share of 0, with an interval that ends above 0.

    name : of the area; flown : number of rocks flown
    """
    low, high = wilson_interval(0, max(int(flown), 1))
    return AreaEvidence(
        name=name, flown=int(flown), reached=0, low=low, high=high, p95_energy=None, largest_energy=None,
        first_arrival_s=None,
    )  # fmt: skip


def _reached(name: str, layers: Layers, row: int, flown: int) -> AreaEvidence:
    """Return the evidence of an area that rocks reached.

    The p95 energy is the upper end of its bin, but at most the largest energy.

    name : of the area; layers, row : map values of areas, and the row of this area; flown : number of rocks flown
    """
    reached = int(layers.rocks[row])
    largest, p95 = float(layers.energy.largest[row]), _known(layers.energy.p95[row])
    low, high = wilson_interval(reached, max(flown, 1, reached))
    return AreaEvidence(
        name=name,
        flown=flown,
        reached=reached,
        low=low,
        high=high,
        p95_energy=None if p95 is None else min(p95 * (1.0 + layers.percentiles_within), largest),
        largest_energy=largest,
        first_arrival_s=_known(layers.first_arrival[row]),
    )


def _known(value: np.floating[Any]) -> float | None:
    """Return a value of a map as a number for JSON: None where the map has NaN."""
    return None if math.isnan(value) else float(value)
