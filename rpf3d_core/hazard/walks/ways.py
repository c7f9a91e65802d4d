"""The lengths of ways in plan inside cells: what passages per metre are made of, whatever the size of the cells.

A cell of area A in which the tracks of rocks have the lengths l in plan has a track density of sum(l) / A. That is the
number of passages per metre of a line across the way of each rock: a rock that crosses a strip of length L across its
way, and of depth d along it, leaves l = d on A = L d. A sum over lengths and an area are additive, so the density of a
cell is the mean of the densities of its parts: its expectation at a place does not depend on the cell, but for what
the cell averages over. (Chilton 1978, Health Phys. 34:637: fluence as track length over volume, any shape of volume;
ICRU report 85, section 3.1. A raster has tracks in a plane, and areas.)

Sums are of whole numbers, so they have the same bits in any order.
"""

from typing import Any

import numpy as np

from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.tracks import Track, pace_of
from rpf3d_core.jit.dispatch import kernel

WAY_UNITS = 2.0**20
"""A way counts in units of the cell's width over 2^20, and its square in units of the cell's area over 2^20. 2^29 rocks
of which each goes 128 widths in one cell fit in 64 bits."""
WAY, SQUARE = 0, 1
"""Columns of what is kept of a cell: the sum of the rocks' ways, and of their squares."""
WAY_BYTES = 16
"""That a cell which rocks came to needs for both."""


@kernel
def begin_way(way: Any, k: int) -> None:
    """Begin visit k without a way; nothing where no ways are gathered (None)."""
    if way is None:
        return
    way[k] = 0.0


@kernel
def note_way(way: Any, k: int, raster: Raster, i: int, j: int, track: Track, begin: float, leave: float) -> None:
    """Add the way of a track between two times to visit k, as far as it lies in square (i, j), in widths of it.

    The squares of the rim reach out without end for `walk_raster`, but what lies outside the raster is not counted:
    it has no area.
    """
    if way is None:
        return
    if k >= 0:
        x, v = track.arc.x, track.arc.v
        first, last = _inside(begin, leave, raster.x + i * raster.cell, raster.cell, x[0], v[0])
        first, last = _inside(first, last, raster.y + j * raster.cell, raster.cell, x[1], v[1])
        if last > first:
            way[k] += (last - first) * np.sqrt(v[0] * v[0] + v[1] * v[1]) / raster.cell


@kernel
def _inside(begin: float, leave: float, low: float, side: float, x: float, v: float) -> tuple[float, float]:
    """The part of a stretch of time in which a coordinate that moves from x with v lies between low and low + side."""
    pace = pace_of(v)
    if pace == np.inf:
        return (begin, leave) if low <= x <= low + side else (leave, leave)
    one, other = (low - x) * pace, (low + side - x) * pace
    return max(begin, min(one, other)), min(leave, max(one, other))


@kernel
def add_way(ways: Any, way: Any, s: int, k: int) -> None:
    """Add the way of visit k, and its square, to what is kept of a cell in slot s; nothing where none is (None)."""
    if way is None:
        return
    length = way[k]
    ways[s, WAY] += np.int64(length * WAY_UNITS + 0.5)
    ways[s, SQUARE] += np.int64(length * length * WAY_UNITS + 0.5)
