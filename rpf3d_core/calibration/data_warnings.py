"""Warnings about observations of a calibration that determine less than it seems."""

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from rpf3d_core.calibration.data_checks import FEW_STOPS, off_terrain
from rpf3d_core.calibration.density import LEAST_STOPS
from rpf3d_core.calibration.flying import Flown, Slope
from rpf3d_core.calibration.observations import Field

NAMED = 5
"""Largest number of stops that a sentence names."""


def data_warnings(slope: Slope, flown: list[Flown]) -> tuple[str, ...]:
    """Return sentences on observations that determine less than it seems.

    flown : all flown parameter sets
    """
    field = slope.field
    return *_of_number(len(field.stops)), *_of_place(slope), *_of_counts(field), *_of_gates(slope, flown)


def _of_number(stops: int) -> Iterator[str]:
    """Yield a sentence if the number of observed stops is too small for the misfit, or for reliable intervals."""
    if stops < LEAST_STOPS:
        yield (f"the error of the model (misfit) is unknown, because it needs {LEAST_STOPS} end points or more and the "
               f"scene has {stops}: the model counts as exact, so all intervals are too narrow")  # fmt: skip
    elif stops < FEW_STOPS:
        yield (f"only {stops} end points were observed; so few hardly determine the error of the model or the coverage "
               f"of intervals: survey at least {FEW_STOPS}")  # fmt: skip


def _of_place(slope: Slope) -> Iterator[str]:
    """Yield a sentence if observed stops lie off the terrain."""
    off = off_terrain(slope.prepared, slope.directions, slope.field)
    if len(off):
        more = ", ..." if len(off) > NAMED else ""
        yield (f"{len(off)} of {len(slope.field.stops)} end points lie off the terrain in plan or over a hole of it "
               f"(number {', '.join(map(str, off[:NAMED].tolist()))}{more}): no simulated rock can stop there; check "
               "their coordinates, or extend the terrain")  # fmt: skip


def _of_counts(field: Field) -> Iterator[str]:
    """Yield sentences if rocks are probably observed twice: by counts and end points, or by several counts."""
    places = sorted({one.place for one in field.counted if one.of == len(field.stops)})
    if places:
        yield (
            f"the counts of {', '.join(places)} are of {len(field.stops)} rocks, as many as there are end points: "
            "if they are the same rocks, they count twice and intervals are too narrow; leave these counts out"
        )
    counts = defaultdict[int, list[str]](list)
    for one in field.counted:
        counts[one.of].append(f"{one.kind} {one.place}")
    for rocks, several in counts.items():
        if len(several) > 1:
            yield (
                f"the counts {', '.join(several)} are of {rocks} rocks each: if they are the same rocks, the counts "
                "depend on each other and intervals are too narrow; keep one of them, or give the end points"
            )


def _of_gates(slope: Slope, flown: list[Flown]) -> Iterator[str]:
    """Yield sentences on values at gates, and on gates where no simulated rock fits the observations.

    Values at gates have no error of the model, so intervals are too narrow where the model is poor.
    """
    gates = sorted({one.gate for one in slope.field.values})
    if gates:
        yield (f"the values observed at {', '.join(gates)} carry their measuring error but no error of the model: "
               "intervals are too narrow where the model is poor")  # fmt: skip
    for gate, at in sorted(_gates_without_rocks(slope, flown)):
        yield (f"at the gate {gate} (at {at:g} m), no simulated rock had what was observed: none passed, or none with "
               "such values; check its distance along `observed.along`, and units")  # fmt: skip


def _gates_without_rocks(slope: Slope, flown: list[Flown]) -> set[tuple[str, float]]:
    """Return name and distance (m) of the gates whose observations have a density of 0 under every set.

    Counts of passed rocks are compared without an error of the model: the error would let rocks pass that stopped
    before the gate.
    """
    most = np.max([one.densities[:, 0].max(axis=0) for one in flown], axis=0)
    return {(name, at) for name, at, column in _gate_columns(slope.field) if not most[column].any()}


def _gate_columns(field: Field) -> Iterator[tuple[str, float, slice]]:
    """Yield name and distance (m) of each gate, with the columns of `Flown.densities` that only passing rocks fill."""
    column = len(field.stops)
    for values in field.values:
        yield values.gate, values.at, slice(column, column + len(values.observed))
        column += len(values.observed)
    for count in field.counted:
        if count.kind == "passed" and count.at is not None and count.rocks:
            yield count.place, count.at, slice(column, column + 1)
        column += 2
