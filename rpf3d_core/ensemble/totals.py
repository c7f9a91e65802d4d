"""Add up the totals of an ensemble while it flies: number of rocks by outcome, and distributions over all rocks."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.bodies import WHY_STOPPED
from rpf3d_core.ensemble.broken import DUST_UNITS
from rpf3d_core.ensemble.flights import Deposits, FloatArray
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.simulation.engines import SPIN_FINALS
from rpf3d_core.values import DEPOSITED, Outcome

PATH_UNITS = 2**20
"""Number of units per metre in sums of path lengths: sums of whole numbers are the same in any order of the rocks."""

Position = Callable[[FloatArray], FloatArray]
"""Function from points (N, 3) m, local frame, to coordinates (N,) m along the direction of the observed stops."""


class FarthestRock(NamedTuple):
    """The rock that stopped farthest from its release.

    runout : m; source, rock, piece : numbers of the source, of the rock in its source, and of the fragment
    """

    runout: float
    source: int
    rock: int
    piece: int


@dataclass(eq=False)
class Totals:
    """Counts and distributions over all flown rocks, for the summary of a run.

    Rocks that failed are counted, but are in no distribution.

    position : function that returns the positions (m) of stops along the direction in which they are compared with
        observed end points, as from `prepared.position_of_stops`; None if the scene has no observed end points
    pieces : number of rocks that are fragments; dust : mass of fragments too small to fly, in DUST_UNITS
    spins : True if rocks spin; only then rotational and total energies are gathered
    why : number of rocks with a shape that stopped, by reason (`bodies.WHY_STOPPED`); empty for points and spheres
    lifted, most_lifted : number of rocks with a shape lifted off the ground at their release, largest lift (m)
    outcomes : number of rocks by outcome; impacts : number of impacts of all rocks
    path : length of the paths of all rocks that did not fail, in PATH_UNITS
    runout : sample of runouts (m); stops : sample of the results of `position` (m)
    farthest : the rock with the largest runout of all rocks that stopped, the first one if several are equal; None if
        no rock stopped, or if all runouts are 0
    max_speed, max_energy, max_height, ground_speed, max_rotational_energy, max_total_energy : samples of the columns of
        `Deposits`
    """

    position: Position | None = None
    outcomes: Counter[Outcome] = field(default_factory=Counter)
    impacts: int = 0
    path: int = 0
    pieces: int = 0
    dust: int = 0
    runout: Sample = field(default_factory=Sample)
    max_speed: Sample = field(default_factory=Sample)
    max_energy: Sample = field(default_factory=Sample)
    max_height: Sample = field(default_factory=Sample)
    ground_speed: Sample = field(default_factory=Sample)
    stops: Sample = field(default_factory=Sample)
    spins: bool = False
    max_rotational_energy: Sample = field(default_factory=Sample)
    max_total_energy: Sample = field(default_factory=Sample)
    why: Counter[str] = field(default_factory=Counter)
    lifted: int = 0
    most_lifted: float = 0.0
    farthest: FarthestRock | None = None

    @property
    def rocks(self) -> int:
        """Number of rocks that have flown."""
        return sum(self.outcomes.values())

    @property
    def path_m(self) -> float:
        """Length of the paths of all rocks that did not fail (m)."""
        return float(Fraction(self.path, PATH_UNITS))

    @property
    def mass_lost_kg(self) -> float:
        """Mass of the fragments that were too small to fly (kg)."""
        return float(Fraction(self.dust, DUST_UNITS))

    def add(self, deposits: Deposits) -> None:
        """Add the results of more rocks to the totals."""
        codes, counts = np.unique(deposits.outcome, return_counts=True)
        self.outcomes.update({Outcome(code): int(n) for code, n in zip(codes, counts, strict=True)})
        self.impacts += int(deposits.impacts.sum())
        self.pieces += int((deposits.piece > 0).sum())
        if deposits.why is not None:
            self.why.update({reason: int((deposits.why == code).sum()) for code, reason in enumerate(WHY_STOPPED)})
        if deposits.lift is not None and len(deposits.lift):
            self.lifted += int((deposits.lift > 0.0).sum())
            self.most_lifted = max(self.most_lifted, float(deposits.lift.max()))
        sound = deposits.outcome != Outcome.FAILED
        self.path += sum(np.rint(deposits.path[sound] * PATH_UNITS).astype(np.int64).tolist())
        at_rest = np.isin(deposits.outcome, DEPOSITED)
        self.runout.add(runout(deposits)[at_rest])
        self.farthest = _farther(self.farthest, _farthest_of(deposits, at_rest))
        for name in ("max_speed", "max_energy", "max_height", "ground_speed", *(SPIN_FINALS if self.spins else ())):
            getattr(self, name).add(getattr(deposits, name)[sound])
        if self.position is not None:
            self.stops.add(self.position(deposits.x[at_rest]))

    def join(self, other: "Totals") -> None:
        """Add the totals of another part of the same ensemble, such as from another process."""
        self.outcomes.update(other.outcomes)
        self.why.update(other.why)
        self.lifted += other.lifted
        self.most_lifted = max(self.most_lifted, other.most_lifted)
        self.impacts += other.impacts
        self.path += other.path
        self.pieces += other.pieces
        self.dust += other.dust
        self.farthest = _farther(self.farthest, other.farthest)
        for name in ("runout", "max_speed", "max_energy", "max_height", "ground_speed", "stops", *SPIN_FINALS):
            getattr(self, name).join(getattr(other, name))


def _farthest_of(deposits: Deposits, at_rest: NDArray[np.bool_]) -> FarthestRock | None:
    """Return the rock with the largest runout of the rocks that stopped, the first one if several are equal.

    The result is None if no rock stopped, or if all these runouts are 0.

    at_rest : (R,) True for the rocks that stopped
    """
    length = np.where(at_rest, runout(deposits), 0.0)
    if not len(length) or not length.max() > 0.0:
        return None
    row = int(length.argmax())
    key = (int(column[row]) for column in (deposits.source, deposits.rock, deposits.piece))
    return FarthestRock(float(length[row]), *key)


def _farther(first: FarthestRock | None, second: FarthestRock | None) -> FarthestRock | None:
    """Return the rock with the larger runout, or `first` if both are equal; None stands for no rock."""
    if first is None or second is None:
        return first or second
    return second if second.runout > first.runout else first


def runout(deposits: Deposits) -> FloatArray:
    """Return the runout (R,) m of rocks: the horizontal distance from release to end."""
    run: FloatArray = np.linalg.norm(deposits.x[:, :2] - deposits.release[:, :2], axis=1)
    return run
