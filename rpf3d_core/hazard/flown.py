"""Flown rocks in the form that the compiled loops of the hazard maps read."""

from typing import Any, NamedTuple

from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.flights import FloatArray


class FlownRocks(NamedTuple):
    """The records of N flown rocks, which are counted in hazard maps.

    impacts, facets : (I, 9) and (I,), impacts of all rocks, and the facet that each impact struck
    pieces, modes : (S, 10) and (S,), path segments of all rocks, and how the rock moves on each, such as in flight
    first : (N + 1, 2) first row of each rock in impacts and in pieces; at the end, the numbers of rows
    finals, counts : (N, 8) and (N, 4), final state and counts of each rock
    `ensemble.batch.Batch` names the columns of all records; rocks with spin or shape have more columns.
    mass : (N,) kg; radius : (N,) m; gravity : m/s^2
    spins : `ensemble.spin.Spins`, the rotation at the ends of segments and before impacts; None if rocks do not spin
    """

    counts: Any
    finals: Any
    impacts: Any
    facets: Any
    pieces: Any
    modes: Any
    first: Any
    mass: Any
    radius: Any
    gravity: float
    spins: Any = None


def flown_rocks(batch: Batch, mass: FloatArray, radius: FloatArray, gravity: float, spins: Any = None) -> FlownRocks:
    """Return the records of a batch of flown rocks, with their masses (N,) kg and radii (N,) m.

    gravity : m/s^2; spins : rotation, from `ensemble.spin.spins_squared`; None if rocks do not spin
    """
    return FlownRocks(
        counts=batch.counts,
        finals=batch.finals,
        impacts=batch.impacts,
        facets=batch.facets,
        pieces=batch.pieces,
        modes=batch.modes,
        first=batch.first,
        mass=mass,
        radius=radius,
        gravity=gravity,
        spins=spins,
    )
