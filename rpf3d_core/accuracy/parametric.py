"""Measure the parametric error: how far the map may be off because the values of the ground are unknown.

Each parameter set of a scene's unknowns is a ground that may be the true one. The error is the distance between the
maps of two such grounds.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.differences import map_distance, share_distance
from rpf3d_core.accuracy.flown import PILOT, FlownSample, affordable, fly, some_rocks
from rpf3d_core.accuracy.statistical import beyond_chance
from rpf3d_core.setup.parameter_sets import flight_of_set
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.setup.unknowns import sets_of_scene

SETS = 32
"""Largest number of parameter sets that are flown to measure the parametric error."""
ROCKS = 1000
"""Largest number of rocks of a lot. A lot is a group of rocks that fly together; each set flies two different lots."""
BUDGET = 12.0
"""Time budget to measure the parametric error with all sets: seconds of one core."""


class OverSets(NamedTuple):
    """The parametric error of a scene, measured with some of its parameter sets; each set flies two lots of rocks.

    A lot is a group of rocks; no rock is in two lots.

    sets : number of parameter sets; rocks : number of rocks of each lot
    distance : root mean square of the distances (-) between the maps of two different sets
    of_map : the part of `distance` (-) that chance does not explain
    of_shares : largest difference (-) between two sets in the share of rocks that reach, or stop in, a zone or area
    seconds_per_1000 : s of one core for 1,000 rocks
    """

    sets: int
    rocks: int
    of_map: float
    distance: float
    of_shares: float
    seconds_per_1000: float


def over_sets(prepared: Prepared) -> OverSets | None:
    """Return the parametric error of a scene; None if the scene has no unknowns, because nothing can be measured."""
    if not prepared.scene.has_unknowns:
        return None
    sets = sets_of_scene(prepared.scene)
    numbers = np.unique(np.linspace(0, len(sets) - 1, min(SETS, len(sets))).astype(int)).tolist()
    pilot = _flown(prepared, sets.at(numbers[0]), PILOT, 0)
    rocks = affordable(ROCKS, pilot.seconds / PILOT * 2 * len(numbers), BUDGET)
    # Each set flies two lots of rocks that no other set flies: two lots of one set differ by chance alone.
    pairs = [
        (_flown(prepared, sets.at(number), rocks, 2 * k), _flown(prepared, sets.at(number), rocks, 2 * k + 1))
        for k, number in enumerate(numbers)
    ]
    return compared(pairs)


def _flown(prepared: Prepared, values: dict[str, float], rocks: int, lot: int) -> FlownSample:
    """Fly one lot (group) of rocks over the ground of one parameter set, and return the result.

    values : value of each unknown, by key path; rocks : number of rocks of the lot
    lot : number of the lot, from 0, which selects the rocks
    """
    return fly(replace(prepared, flight=flight_of_set(prepared, values)), some_rocks(prepared, rocks, lot))


def compared(pairs: Sequence[tuple[FlownSample, FlownSample]]) -> OverSets:
    """Return the parametric error from two lots of rocks of each parameter set; a lot is a group of different rocks.

    Two lots of one set differ by chance alone. Two lots of different sets differ by chance, equally strongly, and also
    because the values of the unknowns differ.

    pairs : the two lots of each set
    """
    crossed = [(pairs[i][0], pairs[j][1]) for i in range(len(pairs)) for j in range(len(pairs)) if i != j]
    distance = _root_mean_square([map_distance(a.reached, b.reached) for a, b in crossed])
    chance = _root_mean_square([map_distance(a.reached, b.reached) for a, b in pairs])
    return OverSets(
        sets=len(pairs),
        rocks=pairs[0][0].reached.flown,
        of_map=beyond_chance(distance, chance),
        distance=distance,
        of_shares=max((share_distance(a.places, b.places) for a, b in crossed), default=0.0),
        seconds_per_1000=float(np.mean([each.seconds_per_1000 for pair in pairs for each in pair])),
    )


def _root_mean_square(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / max(len(values), 1))
