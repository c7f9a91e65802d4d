"""The calibration's search: a grid, then finer grids about the best place found. No starting value, no derivative."""

from collections.abc import Callable, Mapping
from itertools import product
from typing import NamedTuple

import numpy as np

ROUNDS = 2
"""Finer grids after the first one; each halves the step."""
FINER = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Places of a finer grid, in steps of the coarser one."""


class Free(NamedTuple):
    """A parameter that is looked for: its lowest and highest value, the values of the first grid, its decimals."""

    name: str
    low: float
    high: float
    values: int
    decimals: int = 3


class Found(NamedTuple):
    """The parameters with the smallest error, that error, and how many sets of parameters were tried."""

    parameters: dict[str, float]
    error: float
    tried: int


def search(error: Callable[[Mapping[str, float]], float], free: tuple[Free, ...]) -> Found:
    """The parameters of the smallest error; the same error is never asked for twice, the first of equals wins."""
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
