"""Rocks that broke, with their state at the moment of breaking: the input from which their fragments are made."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray

SOURCES = 65_536
"""Factor of a fragment's number in the key of its random numbers: source + SOURCES * number. There are at most 65,536
sources, and 65,536 fragments of a rock."""

DUST_UNITS = 2**40
"""Dust is counted in units of 1/2^40 kg: sums of whole numbers are the same in any order."""


@dataclass(frozen=True, eq=False)
class Broken:
    """N rocks that broke.

    rows : (N,) rows in the releases; t : (N,) s; x : (N, 3) m; v : (N, 3) m/s after the impact; n : (N, 3) unit normal
    """

    rows: IntArray
    t: FloatArray
    x: FloatArray
    v: FloatArray
    n: FloatArray


NONE_BROKEN = Broken(np.empty(0, dtype=np.int64), np.empty(0), *(np.empty((0, 3)) for _ in range(3)))
"""No rocks that broke."""


def rows_of_broken(broken: Broken, which: slice) -> Broken:
    """Return the selected slice of N broken rocks."""
    return Broken(*(getattr(broken, name)[which] for name in ("rows", "t", "x", "v", "n")))


def in_turn(parts: Sequence[Broken]) -> Broken:
    """Join the broken rocks of all parts, one part after another, and number their rows from 0."""
    columns = [np.concatenate([getattr(part, name) for part in parts]) for name in ("t", "x", "v", "n")]
    return Broken(np.arange(len(columns[0])), *columns)


def joined_broken(parts: Sequence[Broken]) -> Broken:
    """Join the broken rocks of all parts, sorted by row."""
    rows = np.concatenate([part.rows for part in parts])
    order = np.argsort(rows)
    columns = (np.concatenate([getattr(part, name) for part in parts])[order] for name in ("t", "x", "v", "n"))
    return Broken(rows[order], *columns)
