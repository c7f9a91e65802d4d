"""Find the best parameters of a noisy model: many sets fly few rocks, and the best sets fly more.

One flight of a rock with a shape takes far longer than one of a point, and the figures of a few hundred rocks are
noisy. A grid of sets with equal numbers of rocks would spend most of them on sets that are far off. This search is
successive halving (Jamieson & Talwalkar 2016, AISTATS): each round keeps the best sets, which fly more rocks.
"""

from collections.abc import Callable, Mapping
from itertools import product
from typing import NamedTuple

import numpy as np

from field_cases.search import Found, Free

Parameters = Mapping[str, float]


class Round(NamedTuple):
    """A round of the search: numbers of the rocks that each set flies, in all rounds so far, and the sets it keeps."""

    rocks: int
    kept: int


def race(error: Callable[[Parameters, int], float], free: tuple[Free, ...], rounds: tuple[Round, ...]) -> list[Found]:
    """Return the sets of the last round with their errors, the best first.

    error : returns the error of a set with a number of rocks
    Each `Found` has the number of sets in the first round. Of equal errors, the set that comes first in the grid wins.
    """
    axes = [np.linspace(one.low, one.high, one.values) for one in free]
    names = [one.name for one in free]
    rounded = [[round(float(v), one.decimals) for v in axis] for axis, one in zip(axes, free, strict=True)]
    sets = [dict(zip(names, place, strict=True)) for place in product(*rounded)]
    tried, errors = len(sets), [0.0] * len(sets)
    for one in rounds:
        errors = [error(parameters, one.rocks) for parameters in sets]
        best = sorted(range(len(sets)), key=errors.__getitem__)[: one.kept]
        sets, errors = [sets[k] for k in best], [errors[k] for k in best]
    return [Found(parameters, of, tried) for parameters, of in zip(sets, errors, strict=True)]
