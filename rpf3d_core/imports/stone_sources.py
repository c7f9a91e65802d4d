"""Find the source cells of a STONE input set: how many rocks start in each cell, and in which direction."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.imports.grids import Cells, Grids, refuse_where
from rpf3d_core.imports.rims import surrounded
from rpf3d_core.terrain.frame import FloatArray

SOURCES = "sources"
STOP = -1
"""Value in the source grid that marks a cell in which every rock stops."""

NEIGHBOURS = {
    "north": (0, 1), "north_east": (1, 1), "east": (1, 0), "south_east": (1, -1),
    "south": (0, -1), "south_west": (-1, -1), "west": (-1, 0), "north_west": (-1, 1),
}  # fmt: skip
"""The eight neighbours of a cell, with steps (cells) to the east and north.

A rock starts towards the neighbour with the steepest fall; of equally steep neighbours, the first is taken.
"""

MOST_LINES = 5_000_000
"""Largest total number of lines in all files of source points; more lines would take minutes to read."""


class Start(NamedTuple):
    """All rocks that start in one of eight directions, from their source cells towards a neighbouring cell.

    direction : name of the direction, such as "north_east"; rocks : number of rocks
    step : from a source cell to the neighbour, as numbers of cells to the east and to the north
    points : (N, 2) m in plan, centres of the source cells; a centre is repeated in proportion to the cell's rocks
    """

    direction: str
    step: tuple[int, int]
    points: FloatArray
    rocks: int


class StoneStarts(NamedTuple):
    """All starts of a STONE input set, grouped by direction.

    cells : number of source cells used; rising : number of used source cells without a lower neighbour
    left_out : number of source cells not used, because they are at the boundary of the terrain or next to missing
        ground
    """

    starts: list[Start]
    cells: int
    rising: int
    left_out: int


def starts_of(grids: Grids) -> StoneStarts:
    """Return the starts of all source cells, grouped by direction: each rock starts towards the steepest neighbour.

    Raises
    ------
    InputError
        A number is not one of -1, 0, 1, 2, ...; or there is no source cell; or the files of source points would have
        more than MOST_LINES (5 million) lines in total. The message names the file.
    """
    rocks = source_rocks(grids)
    wanted = grids.ground & (rocks > 0)
    cells = wanted & surrounded(grids.ground)
    if not cells.any():
        where = "is above 0 nowhere but at the rim of the ground" if wanted.any() else "is above 0 nowhere"
        raise InputError(
            f"{grids.files[SOURCES]}: {where}, so no rock falls; source cells must have the number of their rocks"
        )
    steepest, fall = steepest_neighbour(grids)
    each = int(np.gcd.reduce(rocks[cells]))
    _refuse_too_many(grids, int(rocks[cells].sum()) // each)
    towards = [(k, cells & (steepest == k)) for k in range(len(NEIGHBOURS))]
    starts = [_start(grids, k, its, rocks, each) for k, its in towards if its.any()]
    return StoneStarts(
        starts=starts,
        cells=int(cells.sum()),
        rising=int((cells & (fall <= 0.0)).sum()),
        left_out=int(wanted.sum() - cells.sum()),
    )


def source_rocks(grids: Grids) -> NDArray[np.int64]:
    """Return the number (H, W) of rocks that start in each cell; STOP (-1) where every rock stops.

    The result is 0 where the grid has no value.

    Raises
    ------
    InputError
        A value is not a whole number of at least -1.
    """
    given = grids.values[SOURCES]
    wrong = np.isfinite(given) & ((given != np.floor(given)) | (given < STOP))
    refuse_where(grids, SOURCES, wrong, f"must be a whole number of rocks, 0, or {STOP} where rocks stop")
    return np.where(np.isfinite(given), given, 0.0).astype(np.int64)


def steepest_neighbour(grids: Grids) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the neighbour (H, W) with the steepest fall from each cell, and the gradient (H, W) (-) to this neighbour.

    A neighbour is an index in NEIGHBOURS: 0 is north, and the others follow clockwise. The gradient is positive
    downhill, and negative if all neighbours are higher.

    If the cell or all its neighbours have no height, the gradient is -inf, and the index has no meaning.
    """
    heights = grids.values["dem"]
    wide = np.pad(heights, 1, constant_values=np.nan)
    rows, columns = heights.shape
    falls = []
    for east, north in NEIGHBOURS.values():
        there = wide[1 - north : 1 - north + rows, 1 + east : 1 + east + columns]
        falls.append((heights - there) / (grids.cell * math.hypot(east, north)))
    fall = np.stack(falls)
    known = np.where(np.isfinite(fall), fall, -np.inf)
    return known.argmax(axis=0), np.asarray(known.max(axis=0))


def _start(grids: Grids, direction: int, cells: Cells, rocks: NDArray[np.int64], each: int) -> Start:
    name = list(NEIGHBOURS)[direction]
    points = np.repeat(grids.centres(cells), rocks[cells] // each, axis=0)
    return Start(direction=name, step=NEIGHBOURS[name], points=points, rocks=int(rocks[cells].sum()))


def _refuse_too_many(grids: Grids, lines: int) -> None:
    if lines > MOST_LINES:
        raise InputError(
            f"{grids.files[SOURCES]}: its numbers of rocks make {lines:,} lines of source points, more than "
            f"{MOST_LINES:,}; round them to multiples of one number"
        )
