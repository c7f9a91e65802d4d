"""Store the state of rocks at the moment when they broke; fragments are made from this state."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray

SOURCES = 65_536
"""Factor in the key of a fragment's random numbers, source + SOURCES * number, so that all keys differ.

There are at most 65,536 sources, and fewer than 65,536 fragments of a rock; `number` is the fragment's number.
"""

DUST_UNITS = 2**40
"""Units per kg in which dust (fragments too small to fly) is counted: whole numbers have the same sum in any order."""


@dataclass(frozen=True, eq=False)
class Broken:
    """The rocks of a batch that broke, N of them, with their state when they broke.

    rows : (N,) rows in the releases; t : (N,) s, since the release of the whole rock; x : (N, 3) m
    v : (N, 3) m/s, velocity after the impact; n : (N, 3) unit normal of the impact
    """

    rows: IntArray
    t: FloatArray
    x: FloatArray
    v: FloatArray
    n: FloatArray


NONE_BROKEN = Broken(np.empty(0, dtype=np.int64), np.empty(0), *(np.empty((0, 3)) for _ in range(3)))
"""The `Broken` of a batch in which no rock broke: it has no rows."""


def rows_of_broken(broken: Broken, which: slice) -> Broken:
    """Return some of the broken rocks, so that the caller can make the fragments of a few rocks at a time.

    which : slice that selects rows of `broken`
    """
    return Broken(*(getattr(broken, name)[which] for name in ("rows", "t", "x", "v", "n")))


def in_turn(parts: Sequence[Broken]) -> Broken:
    """Return the broken rocks of several parts joined into one, one part after another.

    The column `rows` of the result is 0, 1, 2, ...: it refers to a table of releases that the caller makes, with the
    releases of the broken rocks only, in the order of the result.
    """
    columns = [np.concatenate([getattr(part, name) for part in parts]) for name in ("t", "x", "v", "n")]
    return Broken(np.arange(len(columns[0])), *columns)


def joined_broken(parts: Sequence[Broken]) -> Broken:
    """Return the broken rocks of several parts joined into one, sorted by row in the releases; rows stay the same."""
    rows = np.concatenate([part.rows for part in parts])
    order = np.argsort(rows)
    columns = (np.concatenate([getattr(part, name) for part in parts])[order] for name in ("t", "x", "v", "n"))
    return Broken(rows[order], *columns)
