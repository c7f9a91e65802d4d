"""Make the warnings about observations that can be made before rocks fly, for `rpf3d check` and for a calibration."""

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from rpf3d_core.calibration.data_checks import FEW_STOPS
from rpf3d_core.calibration.density import LEAST_STOPS
from rpf3d_core.calibration.observations import Field
from rpf3d_core.ensemble.even_rounds import rocks_of_round
from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.setup.prepared import Prepared, releases_in_ranges

OTHER_ROCKS = 2.0
"""Largest factor (-) between the median masses of the observed blocks and of the scene's rocks without a warning."""
COMPARED = 256
"""Number of the scene's rocks whose masses are compared with the observed masses."""


def field_warnings(prepared: Prepared, field: Field) -> tuple[str, ...]:
    """Return the warnings about observations, as sentences; a calibration with such observations may mislead.

    The causes: too few stops; masses unlike the masses of the scene's rocks, or in a doubtful unit; rocks that are
    probably counted twice; values at gates without a measuring error.
    """
    return *_of_number(len(field.stops)), *_of_masses(prepared, field), *_of_counts(field), *_of_errors(field)


def _of_number(stops: int) -> Iterator[str]:
    """Yield a sentence if the observed stops are too few to estimate the misfit, or to judge the intervals."""
    if stops < LEAST_STOPS:
        yield (f"the error of the model (misfit) is unknown, because it needs {LEAST_STOPS} end points or more and the "
               f"scene has {stops}: the model counts as exact, so all intervals are too narrow")  # fmt: skip
    elif stops < FEW_STOPS:
        yield (f"only {stops} end points were observed; so few hardly determine the error of the model or the coverage "
               f"of intervals: survey at least {FEW_STOPS}")  # fmt: skip


def _of_masses(prepared: Prepared, field: Field) -> Iterator[str]:
    """Yield a sentence if the unit of the observed masses is in doubt, and another if the masses do not fit the scene.

    The masses do not fit if their median differs from that of the scene's rocks by more than the factor OTHER_ROCKS.
    """
    if field.masses is None:
        return
    if field.doubt:
        yield field.doubt
    rocks = min(sum(source.rocks for source in prepared.sources), COMPARED)
    masses = releases_in_ranges(prepared, rocks_of_round(prepared.sources, rocks, 0)).mass
    observed, simulated = float(np.median(field.masses)), float(np.median(masses))
    if not 1.0 / OTHER_ROCKS <= observed / simulated <= OTHER_ROCKS:
        yield (f"the median mass of the {len(field.masses)} observed blocks is {three_figures(observed)} kg, that of "
               f"the scene's rocks {three_figures(simulated)} kg: check the unit of the masses (kg); the calibration "
               "flies the observed masses, but runs of its result fly the scene's rocks (`rock: {mass: {measured: "
               "FILE, column: NAME}}` flies the observed masses)")  # fmt: skip


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
        counts[one.of].append(f"{one.kind} at {one.place}")
    for rocks, several in counts.items():
        if len(several) > 1 and rocks != len(field.stops):
            yield (
                f"the counts {', '.join(several)} are of {rocks} rocks each: if they are the same rocks, the counts "
                "depend on each other and intervals are too narrow; keep one of them"
            )


def _of_errors(field: Field) -> Iterator[str]:
    """Yield a sentence if values at gates have a measuring error of 0, as if they were exact."""
    exact = sorted({f"{one.kind} at {one.gate}" for one in field.values if not one.error})
    if exact:
        yield (f"values count as exact ({', '.join(exact)}): intervals are too narrow; give their measuring error as "
               "`speed_error`, `height_error` or `energy_error` of the gate")  # fmt: skip
