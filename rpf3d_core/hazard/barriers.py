"""What rocks did at each barrier: caught, broken through, flown over; with what energy, and how high.

A rock counts once at a barrier: as caught there, else as broken through if it ever did, else as flown over. Whoever
flies over leaves no mark on its path, so the arcs that were written down are crossed with the panels once more.
"""

import math
import threading
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.arc import Arc, velocity
from rpf3d_core.compiling import kernel, loop
from rpf3d_core.effects.barriers import BELOW, Barriers, crossing_of
from rpf3d_core.effects.obstacle_cells import index_of, leaves_at
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.simulation.record import FIRST_OBSTACLE
from rpf3d_core.values import Mode, Outcome
from rpf3d_core.vectors import dot

NEVER, OVER, THROUGH, HELD = range(4)
"""What a rock has done at a barrier; the greater counts."""
FLIGHT, CAUGHT, FAILED = int(Mode.FLIGHT), int(Outcome.CAUGHT), int(Outcome.FAILED)


@dataclass(eq=False)
class AtBarrier:
    """What is counted at one barrier: rocks (4,) by what they did, NEVER ... HELD.

    energy : of each rock that came, its largest there (J); height : of its crossing over the ground (m); over : by how
    much those that flew over were higher than the panel (m)
    """

    rocks: NDArray[np.int64] = field(default_factory=lambda: np.zeros(4, dtype=np.int64))
    energy: Sample = field(default_factory=Sample)
    height: Sample = field(default_factory=Sample)
    over: Sample = field(default_factory=Sample)

    def join(self, other: "AtBarrier") -> None:
        """Gather the rocks of another part of the same ensemble."""
        self.rocks += other.rocks
        for name in ("energy", "height", "over"):
            getattr(self, name).join(getattr(other, name))


class BarrierFigures(NamedTuple):
    """What a barrier did, of `came` rocks that came to it; counts. height : m, that stands; the rest as `AtBarrier`."""

    name: str
    height: float
    capacity: float
    came: int
    caught: int
    broken_through: int
    flown_over: int
    counted: AtBarrier


class Found(NamedTuple):
    """What a batch of N rocks did at B barriers; every array (N, B): NEVER ... HELD, J, m."""

    did: Any
    energy: Any
    height: Any


class BarrierTally:
    """Counts at B barriers. Call it with each batch of flown rocks; any thread may.

    names : (B,); gravity : m/s^2; compiled : as of `hazard.tally.Tally`
    """

    def __init__(self, barriers: Barriers, names: tuple[str, ...], gravity: float, compiled: bool = True) -> None:
        self.barriers, self.names, self.gravity, self.compiled = barriers, names, gravity, compiled
        self.counted = tuple(AtBarrier() for _ in names)
        self._lock = threading.Lock()

    def __call__(self, batch: Batch, releases: Releases) -> None:
        """Count N rocks in."""
        rocks, barriers = len(batch.rows), len(self.names)
        found = Found(
            np.zeros((rocks, barriers), dtype=np.int64), np.zeros((rocks, barriers)), np.zeros((rocks, barriers))
        )
        find = _find_all if self.compiled else _find_all.py_func  # type: ignore[attr-defined]
        written = (batch.counts, batch.impacts, batch.facets, batch.pieces, batch.modes, batch.first)
        mass, radius = releases.mass[batch.rows], releases.radius[batch.rows]
        find(self.barriers, self.gravity, *written, mass, radius, found)
        with self._lock:
            for b, counted in enumerate(self.counted):
                self._add(counted, found, b)

    def join(self, counted: tuple[AtBarrier, ...]) -> None:
        """Count in what another part of the same ensemble has counted."""
        with self._lock:
            for mine, theirs in zip(self.counted, counted, strict=True):
                mine.join(theirs)

    @property
    def figures(self) -> tuple[BarrierFigures, ...]:
        """What each barrier did, in the scene's order."""
        panel = self.barriers.panel
        return tuple(
            BarrierFigures(
                name, float(panel.height[b]), float(panel.capacity[b]), int(at.rocks[1:].sum()), int(at.rocks[HELD]),
                int(at.rocks[THROUGH]), int(at.rocks[OVER]), at,
            )
            for b, (name, at) in enumerate(zip(self.names, self.counted, strict=True))
        )  # fmt: skip

    def _add(self, counted: AtBarrier, found: Found, b: int) -> None:
        did = found.did[:, b]
        counted.rocks += np.bincount(did, minlength=4)
        counted.energy.add(found.energy[did != NEVER, b])
        counted.height.add(found.height[did != NEVER, b])
        counted.over.add(found.height[did == OVER, b] - self.barriers.panel.height[b])


@loop
def _find_all(
    barriers: Barriers, gravity: float, counts: Any, impacts: Any, facets: Any, pieces: Any, modes: Any, first: Any,
    mass: Any, radius: Any, found: Found,
) -> None:  # fmt: skip
    """What each rock did, its largest energy and its largest height at each barrier, into found."""
    panel = barriers.panel
    for r in range(len(mass)):
        if counts[r, 0] == FAILED:
            continue
        for q in range(first[r, 0], first[r + 1, 0]):
            k = FIRST_OBSTACLE - facets[q] - barriers.first
            if facets[q] < 0 and 0 <= k < len(panel.x):
                held = counts[r, 0] == CAUGHT and q + 1 == first[r + 1, 0]
                x, b = (impacts[q, 1], impacts[q, 2]), panel.barrier[k]
                height = impacts[q, 3] - _foot(barriers, k, x) + panel.top[b] * radius[r]
                speed2 = impacts[q, 7] * impacts[q, 7]
                _note(found, r, b, HELD if held else THROUGH, 0.5 * mass[r] * speed2, height)
        for p in range(first[r, 1], first[r + 1, 1] - 1):
            _cross(barriers, gravity, pieces, modes, p, mass[r], radius[r], r, found)


@kernel
def _foot(barriers: Barriers, k: int, x: tuple[float, float]) -> float:
    """Height of the foot of piece k at a place in plan (m)."""
    panel = barriers.panel
    dx, dy = panel.dx[k], panel.dy[k]
    along = ((x[0] - panel.x[k]) * dx + (x[1] - panel.y[k]) * dy) / (dx * dx + dy * dy)
    return panel.z[k] + along * panel.dz[k]  # type: ignore[no-any-return]


@kernel
def _note(found: Found, r: int, b: int, did: int, energy: float, height: float) -> None:
    """Note what rock r did at barrier b."""
    found.height[r, b] = height if found.did[r, b] == NEVER else max(found.height[r, b], height)
    found.did[r, b] = max(found.did[r, b], did)
    found.energy[r, b] = max(found.energy[r, b], energy)


@kernel
def _cross(
    barriers: Barriers, gravity: float, pieces: Any, modes: Any, p: int, mass: float, radius: float, r: int,
    found: Found,
) -> None:  # fmt: skip
    """Note where piece p of a path passes barriers without meeting them: above them, or where they hold nothing."""
    duration = pieces[p + 1, 0] - pieces[p, 0]
    if not duration > 0.0:
        return
    x, v = (pieces[p, 1], pieces[p, 2], pieces[p, 3]), (pieces[p, 4], pieces[p, 5], pieces[p, 6])
    flies = modes[p] == FLIGHT
    if flies:
        arc, until = Arc(x, v, gravity), duration
    else:  # a chord, gone in a unit of time
        arc = Arc(x, (pieces[p + 1, 1] - x[0], pieces[p + 1, 2] - x[1], pieces[p + 1, 3] - x[2]), 0.0)
        until = 1.0
    start2 = dot(v, v)
    end = (pieces[p, 7], pieces[p, 8], pieces[p, 9])
    end2 = dot(end, end)
    cells = barriers.cells
    i, j = index_of(arc.x[0], cells.x, cells.cell, cells.nx), index_of(arc.x[1], cells.y, cells.cell, cells.ny)
    while True:
        leave_i = leaves_at(i, cells.nx, cells.x, cells.cell, arc.x[0], arc.v[0])
        leave_j = leaves_at(j, cells.ny, cells.y, cells.cell, arc.x[1], arc.v[1])
        for entry in range(cells.starts[j * cells.nx + i], cells.starts[j * cells.nx + i + 1]):
            k = cells.ids[entry]
            crossing = crossing_of(barriers.panel, barriers.slack, k, arc, until)
            if crossing.t < math.inf:
                going = velocity(arc, crossing.t)
                speed2 = dot(going, going) if flies else start2 + crossing.t * (end2 - start2)
                _note_passing(barriers, k, crossing.height, radius, 0.5 * mass * speed2, r, found)
        if min(leave_i, leave_j) >= until:
            return
        if leave_i <= leave_j:
            i += 1 if arc.v[0] > 0.0 else -1
        else:
            j += 1 if arc.v[1] > 0.0 else -1


@kernel
def _note_passing(
    barriers: Barriers, k: int, height: float, radius: float, energy: float, r: int, found: Found
) -> None:
    """Note a crossing of piece k that the rock did not meet: others have a row of their own among the impacts."""
    b = barriers.panel.barrier[k]
    high = height + barriers.panel.top[b] * radius
    if high > barriers.panel.height[b] or (barriers.panel.height[b] == 0.0 and height >= -BELOW):
        _note(found, r, b, OVER, energy, high)
    elif barriers.panel.capacity[b] == 0.0 and height >= -BELOW:
        _note(found, r, b, THROUGH, energy, high)
