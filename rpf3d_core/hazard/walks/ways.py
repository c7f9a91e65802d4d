"""Measure the lengths of rocks' paths in plan inside cells, from which passages per metre follow.

If the paths of rocks in a cell of area A have the lengths l in plan, the path density of the cell is sum(l) / A. This
density is the number of passages per metre of width, measured across the paths. For example, a strip has the length L
across the path of a rock and the depth d along this path. The rock's path in the area A = L d has the length l = d, so
the density is 1 / L: one passage over a width of L. Lengths and areas are additive, so the density of a cell is the
mean of the densities of its parts, weighted by area. The expected density at a place depends on the cell only because
the density is averaged over the cell.
(Chilton 1978, Health Phys. 34:637: fluence as track length over volume, any shape of volume; ICRU report 85, section
3.1. Here, the plan replaces space, and area replaces volume.)

Lengths are summed as whole numbers, so the sums have the same bits whatever the order of the rocks.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.tracks import Track, pace_of
from rpf3d_core.jit.dispatch import kernel

WAY_UNITS = 2.0**20
"""Number of units in a cell width for sums of path lengths, and in a squared cell width for sums of squared lengths.

Sums are whole numbers of units. Sums over 2^29 rocks with paths of 128 cell widths in one cell fit in 64 bits.
"""
WAY, SQUARE = 0, 1
"""Columns of the path lengths of a cell: their sum over all rocks, and the sum of their squares."""
WAY_BYTES = 16
"""Memory (bytes) of both sums for each cell that rocks reached."""


class Square(NamedTuple):
    """A map cell in plan: its corner with the smallest x and y, and its side (m)."""

    x: float
    y: float
    side: float


@kernel
def square_of(raster: Raster, i: int, j: int) -> Square:
    """Return the map cell in column i and row j of a raster."""
    return Square(x=raster.x + i * raster.cell, y=raster.y + j * raster.cell, side=raster.cell)


@kernel
def begin_length(way: Any, k: int) -> None:
    """Set the path length of a new visit k to 0.

    way : (N,) path length of each visit, in cell widths; None if lengths are not measured: the call then does nothing
    """
    if way is None:
        return
    way[k] = 0.0


@kernel
def note_length(way: Any, k: int, square: Square, track: Track, begin: float, leave: float) -> None:
    """Add to visit k the length (in cell widths) of a track in plan inside a map cell, from `begin` to `leave` (s).

    way : (N,) path length of each visit, in cell widths; None if lengths are not measured: the call then does nothing
    `walk_raster` extends the outermost cells without end, but a part of a track outside the raster is not counted here.
    """
    if way is None:
        return
    if k >= 0:
        x, v = track.arc.x, track.arc.v
        first, last = _inside(begin, leave, square.x, square.side, x[0], v[0])
        first, last = _inside(first, last, square.y, square.side, x[1], v[1])
        if last > first:
            way[k] += (last - first) * np.sqrt(v[0] * v[0] + v[1] * v[1]) / square.side


@kernel
def _inside(begin: float, leave: float, low: float, side: float, x: float, v: float) -> tuple[float, float]:
    """Return the part of a time interval (s) in which a moving coordinate lies between low and low + side (m).

    The result is the begin and the end of the part (s); the end is not after the begin if there is no such part.

    x : coordinate at time 0, m; v : its speed, m/s
    begin, leave : ends of the time interval; low, side : m, begin and width of the range of the coordinate
    """
    pace = pace_of(v)
    if pace == np.inf:
        return (begin, leave) if low <= x <= low + side else (leave, leave)
    one, other = (low - x) * pace, (low + side - x) * pace
    return max(begin, min(one, other)), min(leave, max(one, other))


@kernel
def add_length(ways: Any, way: Any, s: int, k: int) -> None:
    """Add the path length of visit k, and its square, to the sums of its cell in slot s.

    ways : (S, 2) sums of lengths and of squares of lengths, in units of 1 / WAY_UNITS
    way : (N,) path length of each visit, in cell widths; None if lengths are not measured: the call then does nothing
    """
    if way is None:
        return
    length = way[k]
    ways[s, WAY] += np.int64(length * WAY_UNITS + 0.5)
    ways[s, SQUARE] += np.int64(length * length * WAY_UNITS + 0.5)
