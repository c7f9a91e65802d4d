"""Warn if the observations of a calibration determine the unknowns less well than it seems."""

from collections.abc import Iterator

import numpy as np

from rpf3d_core.calibration.data_checks import off_terrain
from rpf3d_core.calibration.field_warnings import field_warnings
from rpf3d_core.calibration.flying import Flown, Slope
from rpf3d_core.calibration.observations import Field

NAMED = 5
"""Largest number of stops that a sentence names."""


def data_warnings(slope: Slope, flown: list[Flown]) -> tuple[str, ...]:
    """Return sentences on observations that determine the unknowns less well than it seems.

    flown : all flown parameter sets
    """
    return *field_warnings(slope.prepared, slope.field), *_of_place(slope), *_of_gates(slope, flown)


def _of_place(slope: Slope) -> Iterator[str]:
    """Yield a sentence if observed stops lie off the terrain."""
    off = off_terrain(slope.prepared, slope.directions, slope.field)
    if len(off):
        more = ", ..." if len(off) > NAMED else ""
        yield (f"{len(off)} of {len(slope.field.stops)} end points lie off the terrain in plan or over a hole of it "
               f"(number {', '.join(map(str, off[:NAMED].tolist()))}{more}): no simulated rock can stop there; check "
               "their coordinates, or extend the terrain")  # fmt: skip


def _of_gates(slope: Slope, flown: list[Flown]) -> Iterator[str]:
    """Yield a sentence if values were observed at gates, and a sentence for each gate that no simulated rock fits.

    The first sentence warns that values at gates are compared without the error of the model (the misfit), so intervals
    are too narrow if the model is poor. `_gates_without_rocks` selects the gates of the other sentences.
    """
    gates = sorted({one.gate for one in slope.field.values})
    if gates:
        yield (f"the comparison with the values observed at {', '.join(gates)} includes the measuring error, but not "
               "the error of the model (misfit): intervals are too narrow where the model is poor")  # fmt: skip
    for gate, at in sorted(_gates_without_rocks(slope, flown)):
        yield (f"no simulated rock fits the observations at the gate {gate} (at {at:g} m): no rock passed the gate, or "
               "no passing rock had such values; check its distance along `observed.along`, and the units")  # fmt: skip


def _gates_without_rocks(slope: Slope, flown: list[Flown]) -> set[tuple[str, float]]:
    """Return name and distance (m) of the gates at which no simulated rock of any flown set fits the observations.

    At such a gate, all observed values of one kind, or the count of passed rocks, have the density 0 under every set.
    The densities are those for the misfit 0. With a larger misfit, a simulated rock that stopped before the gate would
    count as a rock that may have passed the gate.
    """
    most = np.max([one.densities[:, 0].max(axis=0) for one in flown], axis=0)
    return {(name, at) for name, at, column in _gate_columns(slope.field) if not most[column].any()}


def _gate_columns(field: Field) -> Iterator[tuple[str, float, slice]]:
    """Yield name and distance (m) of a gate, and columns of `Flown.densities` with observations of passed rocks.

    There is one item for each kind of values observed at a gate, and one for each gate that at least one counted rock
    passed. A density in these columns is above 0 only if a simulated rock passed the gate. The column for the rocks
    that did not pass is left out.
    """
    column = len(field.stops)
    for values in field.values:
        yield values.gate, values.at, slice(column, column + len(values.observed))
        column += len(values.observed)
    for count in field.counted:
        if count.kind == "passed" and count.at is not None and count.rocks:
            yield count.place, count.at, slice(column, column + 1)
        column += 2
