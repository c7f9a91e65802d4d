"""Tables of the results of an ensemble: one row per rock, one row per impact, one row per event of a path.

All positions are in the terrain's local frame; `Frame.points_to_input` converts them to the input's coordinates.
"""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def no_pieces() -> IntArray:
    """Return an empty array (0,), the default for fragment numbers: it means that no rock is a fragment."""
    return np.empty(0, dtype=np.int64)


def no_spins() -> FloatArray:
    """Return an empty array (0,), the default for spins and their energies: it means that the rocks do not spin."""
    return np.empty(0)


def given_columns(table: Any) -> dict[str, Any]:
    """Return the columns of a table, such as `Deposits`, by name, without the columns that are None."""
    columns = {column.name: getattr(table, column.name) for column in fields(table)}
    return {name: column for name, column in columns.items() if column is not None}


@dataclass(frozen=True, eq=False)
class Deposits:
    """End position and results of each of R rocks, the table behind `deposits.csv`.

    Every array has R rows. Blocks of rocks follow each other as they flew. The rows of a block are in order of source,
    then rock; then follow the fragments of these rocks. (After `joined.joined`: by source, then rock, then fragment.)

    source : index of the scene's source; rock : number within its source, from 0
    outcome : `values.Outcome`; facet : facet of the last contact, -1 if the rock never touched the ground
    release : (R, 3) m, start position; x : (R, 3) m, end position; t : s, end time since the release of the rock, or of
        the whole rock for a fragment; path : m, length flown and slid; impacts : count
    max_speed : m/s; max_energy : J, translational
    max_height : m, largest height on the whole path above the facet vertically below (`hazard.tallies` computes it);
        NaN for a rock that failed, and for all rocks if the ensemble flew without the callback `batches.Watch`
    ground_speed : m/s when the rock first enters sustained contact; NaN without sustained contact
    mass : kg; piece : number of a fragment within its rock, from 1; 0 for the rock itself; zeros by default
    max_rotational_energy, max_total_energy : J, total is translation plus rotation; NaN if rocks spin but no path was
        recorded; by default rocks do not spin: 0 and `max_energy`
    pose, lift, why, shape : only of rocks with a shape, None for points and spheres
        pose : (R, 4) final orientation w, x, y, z; lift : m, by which the rock was lifted off the ground at the release
        why : reason why the rock stopped (`simulation.bodies.rest.Stop`), -1 if it did not stop
        shape : number of the shape
    """

    source: IntArray
    rock: IntArray
    outcome: IntArray
    facet: IntArray
    release: FloatArray
    x: FloatArray
    t: FloatArray
    path: FloatArray
    impacts: IntArray
    max_speed: FloatArray
    max_energy: FloatArray
    max_height: FloatArray
    ground_speed: FloatArray
    mass: FloatArray
    piece: IntArray = field(default_factory=no_pieces)
    max_rotational_energy: FloatArray = field(default_factory=no_spins)
    max_total_energy: FloatArray = field(default_factory=no_spins)
    pose: FloatArray | None = None
    lift: FloatArray | None = None
    why: IntArray | None = None
    shape: IntArray | None = None

    def __post_init__(self) -> None:
        """Fill in columns that are not given: rocks do not spin, and no rock is a fragment."""
        if len(self.max_total_energy) != len(self.source):
            object.__setattr__(self, "max_rotational_energy", np.zeros(len(self.source)))
            object.__setattr__(self, "max_total_energy", self.max_energy)
        if len(self.piece) != len(self.source):
            object.__setattr__(self, "piece", np.zeros(len(self.source), dtype=np.int64))


@dataclass(frozen=True, eq=False)
class Impacts:
    """Every impact on the ground and every contact with an obstacle: I rows, grouped by rock in order of time.

    row : row of the rock in `Deposits`; t : s; x : (I, 3) m
    facet : number of the facet; for an obstacle, `simulation.record.FIRST_OBSTACLE` minus the number of the obstacle,
        which is below 0
    normal : (I, 3) unit, turned against the incoming velocity; for an obstacle, the direction opposite to this velocity
    speed_in, speed_out : m/s; spin_in, spin_out : rad/s, zeros by default
    contacts, energy_in, energy_out : of rocks with a shape, number of contacts and kinetic energy before and after the
        impact (J/kg); None for points and spheres
    """

    row: IntArray
    t: FloatArray
    x: FloatArray
    facet: IntArray
    normal: FloatArray
    speed_in: FloatArray
    speed_out: FloatArray
    spin_in: FloatArray = field(default_factory=no_spins)
    spin_out: FloatArray = field(default_factory=no_spins)
    contacts: FloatArray | None = None
    energy_in: FloatArray | None = None
    energy_out: FloatArray | None = None

    def __post_init__(self) -> None:
        """Fill in zeros for spins that are not given."""
        if len(self.spin_in) != len(self.row):
            object.__setattr__(self, "spin_in", np.zeros(len(self.row)))
            object.__setattr__(self, "spin_out", np.zeros(len(self.row)))


def on_ground(impacts: Impacts) -> Impacts:
    """Return the rows of impacts on the ground only, without contacts with obstacles such as barriers and trees."""
    struck = impacts.facet >= 0
    return Impacts(**{name: column[struck] for name, column in given_columns(impacts).items()})


@dataclass(frozen=True, eq=False)
class Paths:
    """The events of rocks' paths: S rows, grouped by rock in order of time.

    A rock has one row for the start of each path segment, and a last row for its end.
    row : row of the rock in `Deposits`; t : s; x : (S, 3) m; v : (S, 3) m/s just after the event
    v_end : (S, 3) m/s at the end of the segment that begins with this event
    mode : `values.Mode` of the segment that begins with this event; the last row of a rock has mode END
    A FLIGHT segment is the exact parabola from (x, v); `sample_paths` draws points from the segments.
    q, w : of rocks with a shape, (S, 4) orientation w, x, y, z and (S, 3) spin (rad/s) in the body's axes just after
        the event; None for points and spheres
    """

    row: IntArray
    t: FloatArray
    x: FloatArray
    v: FloatArray
    v_end: FloatArray
    mode: IntArray
    q: FloatArray | None = None
    w: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Flights:
    """The result of flying an ensemble: the deposits of all rocks, and the impacts and paths that the caller keeps.

    engine : the engine used ("reference" or "compiled")
    compile_s, fly_s : wall seconds for compiling and for flying the rocks
    """

    deposits: Deposits
    impacts: Impacts
    paths: Paths
    engine: str
    compile_s: float
    fly_s: float
