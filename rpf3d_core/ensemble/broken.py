"""Rocks that broke, as they were when they did: what their pieces are made from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray

SOURCES = 65_536
"""What the number of a piece is multiplied by beside a source for its draws: up to 65,536 of either."""

DUST_UNITS = 2**40
"""Dust counts in units of 1/2^40 kg: whole numbers add up alike in any order."""


@dataclass(frozen=True, eq=False)
class Broken:
    """N rocks that broke.

    rows : (N,) of their releases; t : (N,) s; x : (N, 3) m; v : (N, 3) m/s after the impact; n : (N, 3) unit
    """

    rows: IntArray
    t: FloatArray
    x: FloatArray
    v: FloatArray
    n: FloatArray


NONE_BROKEN = Broken(np.empty(0, dtype=np.int64), np.empty(0), *(np.empty((0, 3)) for _ in range(3)))


def rows_of_broken(broken: Broken, which: slice) -> Broken:
    """Return some of N rocks that broke."""
    return Broken(*(getattr(broken, name)[which] for name in ("rows", "t", "x", "v", "n")))


def in_turn(parts: Sequence[Broken]) -> Broken:
    """Return all of them, one after another, with rows that count through."""
    columns = [np.concatenate([getattr(part, name) for part in parts]) for name in ("t", "x", "v", "n")]
    return Broken(np.arange(len(columns[0])), *columns)


def joined_broken(parts: Sequence[Broken]) -> Broken:
    """All of them, in order of their rows."""
    rows = np.concatenate([part.rows for part in parts])
    order = np.argsort(rows)
    columns = (np.concatenate([getattr(part, name) for part in parts])[order] for name in ("t", "x", "v", "n"))
    return Broken(rows[order], *columns)
