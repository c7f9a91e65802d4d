"""Count for each barrier how many rocks it caught, how many broke through, and how many flew over.

A rock arrives where its path crosses a panel's plane between the panel's ends, at the panel or above it. A barrier is
designed for each rock's first arrival, because the barrier has not slowed the rock down before. A rock that breaks
through may return, bounce into the same panel again, or be caught later. So rocks and events are counted separately.
"""

import threading
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.effects.barriers import Barriers
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.hazard.barrier_arrivals import (
    HELD,
    NEVER,
    OVER,
    THROUGH,
    BarrierArrivals,
    empty_arrivals,
    empty_crossed,
    find_arrivals,
)
from rpf3d_core.hazard.by_source.source_arrivals import SourceArrivals
from rpf3d_core.hazard.flown import flown_rocks


@dataclass(eq=False)
class AtBarrier:
    """Counts of the rocks at one barrier, and distributions of their energy and height.

    first : (4,) number of rocks by the result of their first arrival: NEVER (did not arrive), OVER (flew over), THROUGH
        (broke through), HELD (was caught)
    held : number of rocks that the barrier caught in the end
    events : (4,) number of arrivals of all rocks by result, in the same order; events[NEVER] is always 0
    energy, height : distributions over first arrivals: energy (J), and height (m) of the rock's centre or top, as the
        scene chooses, above the foot of the panel
    over : distribution of the height above the upper edge of the panel (m), only over first arrivals that flew over
    """

    first: NDArray[np.int64] = field(default_factory=lambda: np.zeros(4, dtype=np.int64))
    held: int = 0
    events: NDArray[np.int64] = field(default_factory=lambda: np.zeros(4, dtype=np.int64))
    energy: Sample = field(default_factory=Sample)
    height: Sample = field(default_factory=Sample)
    over: Sample = field(default_factory=Sample)

    def join(self, other: "AtBarrier") -> None:
        """Add the counts at this barrier from another part of the same ensemble."""
        self.first += other.first
        self.held += other.held
        self.events += other.events
        for name in ("energy", "height", "over"):
            getattr(self, name).join(getattr(other, name))


class BarrierFigures(NamedTuple):
    """Figures of the rocks at one barrier, for tables and files.

    height : of the panel (m); capacity : of the barrier (J); came : number of rocks that arrived at the barrier
    first_... : number of rocks whose first arrival had this result; caught : number of rocks caught in the end
    ..._events : number of arrivals with this result, over all rocks
    counted : all counts at the barrier, and the distributions of energy and height over first arrivals
    """

    name: str
    height: float
    capacity: float
    came: int
    first_caught: int
    first_broken_through: int
    first_flown_over: int
    caught: int
    caught_events: int
    broken_through_events: int
    flown_over_events: int
    counted: AtBarrier


class BarrierCounts(NamedTuple):
    """The counts of a part of an ensemble at all barriers, which can be sent to another process.

    counted : counts at each barrier; sources : counts for each source, None if sources are not counted
    """

    counted: tuple[AtBarrier, ...] = ()
    sources: SourceArrivals | None = None


class BarrierTally:
    """Counts at all B barriers of a scene, added while rocks fly: call the object with each batch of flown rocks.

    Any thread may call the object.

    names : (B,) names of the barriers; gravity : m/s^2
    compiled : False to count in plain Python, for so few rocks that Python finishes before the loop is compiled
    part : (B,) counts of the parameter set whose rocks fly, to which each batch is also added; empty without parameter
        sets
    sources : counts for each source, None if sources are not counted. The constructor gets the number of sources: with
        one source, sources are not counted
    """

    def __init__(
        self, barriers: Barriers, names: tuple[str, ...], gravity: float, compiled: bool = True, sources: int = 1
    ) -> None:
        self.barriers, self.names, self.gravity, self.compiled = barriers, names, gravity, compiled
        self.counted = tuple(AtBarrier() for _ in names)
        self.part: tuple[AtBarrier, ...] = ()
        self.sources = SourceArrivals(sources, len(names)) if sources > 1 else None
        self._lock = threading.Lock()

    def __call__(self, batch: Batch, releases: Releases) -> None:
        """Add the N rocks of a batch to the counts at the barriers."""
        found = empty_arrivals(len(batch.rows), len(self.names))
        crossed = empty_crossed(len(self.barriers.panel.x), len(self.names))
        find: Any = find_arrivals if self.compiled else find_arrivals.py_func  # type: ignore[attr-defined]
        flown = flown_rocks(batch, releases.mass[batch.rows], releases.radius[batch.rows], self.gravity)
        find(self.barriers, flown, crossed, found)
        with self._lock:
            for counts in (self.counted, self.part):
                for b, counted in enumerate(counts):
                    self._add(counted, found, b)
            if self.sources is not None:
                self.sources.note(found, releases.source[batch.rows], self.barriers.panel.height)

    @property
    def counts(self) -> BarrierCounts:
        """The counts so far, for `join`."""
        return BarrierCounts(self.counted, self.sources)

    def join(self, other: BarrierCounts) -> None:
        """Add the counts at all barriers from another part of the same ensemble.

        Raises
        ------
        ValueError
            Only one of the two parts counts each source separately.
        """
        if (self.sources is None) != (other.sources is None):
            raise ValueError("a part of another ensemble cannot be counted in: only one of both counts each source")
        with self._lock:
            for mine, theirs in zip(self.counted, other.counted, strict=True):
                mine.join(theirs)
            if self.sources is not None and other.sources is not None:
                self.sources.join(other.sources)

    @property
    def figures(self) -> tuple[BarrierFigures, ...]:
        """The counts at each barrier for tables and files, in the scene's order."""
        return tuple(self._figures_of(b, at) for b, at in enumerate(self.counted))

    @property
    def source_figures(self) -> tuple[tuple[BarrierFigures, ...], ...]:
        """The counts of each source at each barrier, in the scene's order; () if sources are not counted."""
        found = self.sources
        if found is None:
            return ()
        return tuple(
            tuple(self._figures_of(b, AtBarrier(*found.at(number, b))) for b in range(len(self.names)))
            for number in range(found.sources)
        )

    def _figures_of(self, b: int, at: AtBarrier) -> BarrierFigures:
        panel = self.barriers.panel
        first, events = at.first.tolist(), at.events.tolist()
        return BarrierFigures(
            name=self.names[b],
            height=float(panel.height[b]),
            capacity=float(panel.capacity[b]),
            came=sum(first[1:]),
            first_caught=first[HELD],
            first_broken_through=first[THROUGH],
            first_flown_over=first[OVER],
            caught=at.held,
            caught_events=events[HELD],
            broken_through_events=events[THROUGH],
            flown_over_events=events[OVER],
            counted=at,
        )

    def _add(self, counted: AtBarrier, found: BarrierArrivals, b: int) -> None:
        did, height = found.did[:, b], found.height[:, b]
        counted.first += np.bincount(did, minlength=4)
        counted.held += int(found.held[:, b].sum())
        counted.events += found.events[:, b].sum(axis=0)
        counted.energy.add(found.energy[did != NEVER, b])
        counted.height.add(height[did != NEVER])
        counted.over.add(height[did == OVER] - self.barriers.panel.height[b])
