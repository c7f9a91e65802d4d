"""Counts of rocks in zones and areas, for each parameter set and each source."""

from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.hazard.by_set.set_places import PlaceCounts, PlaceTally
from rpf3d_core.hazard.by_source.source_tallies import SourceTallies


class SourceSets(NamedTuple):
    """The counts of S parameter sets for N sources, with Z zones and A areas.

    rocks : (S, N) rocks flown from each source with each set
    zones, areas : counts in N Z zones and in N A areas, in the order of `SourceTallies`
    barriers : (N,) for each source, `hazard.by_set.set_barriers.Bands` of each barrier; empty without barriers
    """

    rocks: FloatArray
    zones: PlaceCounts
    areas: PlaceCounts
    barriers: tuple[tuple[Any, ...], ...] = ()

    def of_source(self, number: int) -> tuple[FloatArray, PlaceCounts, PlaceCounts]:
        """Return for one source the rocks of each set (S,), and the counts in the Z zones and in the A areas.

        number : of the source
        """
        sources = self.rocks.shape[1]
        return self.rocks[:, number], _part(self.zones, number, sources), _part(self.areas, number, sources)


def _part(counts: PlaceCounts, number: int, sources: int) -> PlaceCounts:
    """Return the counts in the places of one source; number : of the source, from 0; sources : number of sources."""
    places = len(counts.energy_sampling) // sources
    some = slice(number * places, (number + 1) * places)
    values = {each.name: getattr(counts, each.name)[:, some] for each in fields(counts)}
    return PlaceCounts(**{**values, "energy_sampling": counts.energy_sampling[some]})


class SourceSetTally:
    """Counts rocks in zones and areas for each source and parameter set: call `end` after the rocks of each set."""

    def __init__(self, tallies: SourceTallies, sets: int) -> None:
        self._tallies = tallies
        self._zones, self._areas = PlaceTally(tallies.zones, sets), PlaceTally(tallies.inside, sets)
        self._rocks = np.zeros((sets, len(tallies.names)))
        self._before = np.zeros(len(tallies.names))

    def end(self, number: int) -> None:
        """Add to set `number` all rocks counted since the previous call of `end`, whatever set that call was for.

        This includes the numbers of rocks flown from each source.
        """
        self._zones.end(number)
        self._areas.end(number)
        after = self._tallies.flown.astype(float)
        self._rocks[number] += after - self._before
        self._before = after

    def counts(self) -> SourceSets:
        """Return the counts of all sets so far."""
        return SourceSets(rocks=self._rocks.copy(), zones=self._zones.counts(), areas=self._areas.counts())


def source_set_tally(tallies: SourceTallies | None, sets: int) -> SourceSetTally | None:
    """Return empty counts of `sets` parameter sets for each source; None if sources are not counted."""
    return None if tallies is None else SourceSetTally(tallies, sets)
