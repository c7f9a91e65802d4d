"""Count the arrivals of rocks at barriers, separately for each source and each parameter set.

Many rocks of a harmless source hide the rocks of a dangerous source in the figures of all rocks together.
"""

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.grouped_samples import GroupedSample
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.hazard.barrier_arrivals import NEVER, OVER, BarrierArrivals


class SourceArrivals:
    """Counts at B barriers for each of N sources and each of S parameter sets; S is 1 without parameter sets.

    Rocks that did not arrive at a barrier are not counted.

    sources : N; set : number of the current parameter set, to which `note` adds rocks
    first : (S, N, B, 4) number of rocks by the result of their first arrival, as `AtBarrier.first`; 0 for NEVER
    held : (S, N, B) number of rocks caught in the end; events : (N, B, 4) number of arrivals by result
    energy, height, over : (B,) distributions over first arrivals at each barrier, in which set s of source n is group
        n S + s: energy (J), height (m) above the foot of the panel, and height (m) above the upper edge of the panel of
        rocks that flew over
    """

    def __init__(self, sources: int, barriers: int, sets: int = 1) -> None:
        self.sources, self.set = sources, 0
        self.first = np.zeros((sets, sources, barriers, 4), dtype=np.int64)
        self.held = np.zeros((sets, sources, barriers), dtype=np.int64)
        self.events = np.zeros((sources, barriers, 4), dtype=np.int64)
        self.energy, self.height, self.over = (
            tuple(GroupedSample(sources * sets) for _ in range(barriers)) for _ in range(3)
        )

    def over_sets(self, sets: int) -> "SourceArrivals":
        """Return empty counts of the same sources at the same barriers, for `sets` parameter sets."""
        return SourceArrivals(self.sources, self.held.shape[2], sets)

    def note(self, found: BarrierArrivals, source: IntArray, panel: FloatArray) -> None:
        """Count the arrivals of the N rocks of a batch, all of the current parameter set (`set`).

        source : (N,) number of each rock's source; panel : (B,) m, height of the panel of each barrier
        """
        rock, barrier = np.nonzero(found.did != NEVER)
        did, height, of = found.did[rock, barrier], found.height[rock, barrier], source[rock]
        np.add.at(self.first[self.set], (of, barrier, did), 1)
        np.add.at(self.held[self.set], (of, barrier), found.held[rock, barrier])
        np.add.at(self.events, (of, barrier), found.events[rock, barrier])
        group = of.astype(np.int64) * len(self.first) + self.set
        for b in range(len(panel)):
            here = barrier == b
            self.energy[b].add(group[here], found.energy[rock[here], b])
            self.height[b].add(group[here], height[here])
            passed = here & (did == OVER)
            self.over[b].add(group[passed], height[passed] - panel[b])

    def join(self, other: "SourceArrivals") -> None:
        """Add the counts of another part of the same ensemble."""
        self.first += other.first
        self.held += other.held
        self.events += other.events
        for name in ("energy", "height", "over"):
            for mine, theirs in zip(getattr(self, name), getattr(other, name), strict=True):
                mine.join(theirs)

    def at(self, number: int, b: int) -> tuple[IntArray, int, IntArray, Sample, Sample, Sample]:
        """Return the counts of one source at one barrier over all sets, in the order of the fields of `AtBarrier`.

        The counts of rocks by first result, and of arrivals by result, are (4,).

        number, b : numbers of the source and of the barrier, from 0
        """
        sets = len(self.first)
        first, last = number * sets, (number + 1) * sets
        return (
            self.first[:, number, b].sum(axis=0), int(self.held[:, number, b].sum()), self.events[number, b].copy(),
            self.energy[b].of(first, last), self.height[b].of(first, last), self.over[b].of(first, last),
        )  # fmt: skip
