"""Flown rocks in the form that the compiled loops of the hazard maps read."""

from typing import Any, NamedTuple

from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.flights import FloatArray


class FlownRocks(NamedTuple):
    """The records of N flown rocks, which are counted in hazard maps.

    counts, finals, impacts, facets, pieces, modes, first : as in `ensemble.batch.Batch`
    mass : (N,) kg; radius : (N,) m; gravity : m/s^2
    spins : as in `ensemble.spin.spins_squared`; None if rocks do not spin
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

    gravity, spins : as in `FlownRocks`
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
