"""Find the best set of parameters: try a grid of sets, then finer grids around the best set."""

from collections.abc import Callable, Mapping
from itertools import product
from typing import NamedTuple

import numpy as np

ROUNDS = 2
"""Number of finer grids after the first grid; each halves the step."""
FINER = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Offsets of a finer grid from the best set, in steps of the coarser grid."""


class Free(NamedTuple):
    """A parameter to calibrate: lowest and highest value, number of values in the first grid, decimals of values."""

    name: str
    low: float
    high: float
    values: int
    decimals: int = 3


class Found(NamedTuple):
    """The result of a search: the parameters with the smallest error, this error, and the number of sets tried."""

    parameters: dict[str, float]
    error: float
    tried: int


def search(error: Callable[[Mapping[str, float]], float], free: tuple[Free, ...]) -> Found:
    """Return the set of parameters with the smallest error, or the first of several; no set is tried twice.

    error : returns the error of a set, which is given as name -> value
    """
    known: dict[tuple[float, ...], float] = {}
    axes = [np.linspace(one.low, one.high, one.values) for one in free]
    steps = [float(axis[1] - axis[0]) for axis in axes]
    for _ in range(1 + ROUNDS):
        for place in product(*([round(float(v), one.decimals) for v in a] for a, one in zip(axes, free, strict=True))):
            if place not in known:
                known[place] = error({one.name: value for one, value in zip(free, place, strict=True)})
        best = min(known, key=lambda place: known[place])
        axes = [
            np.unique(np.clip(value + step * np.array(FINER), one.low, one.high))
            for value, step, one in zip(best, steps, free, strict=True)
        ]
        steps = [0.5 * step for step in steps]
    return Found({one.name: value for one, value in zip(free, best, strict=True)}, known[best], len(known))
