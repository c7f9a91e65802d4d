"""Lay out the raster of a hazard map: where its cells lie, how large they are, and how much memory they need."""

import math
from collections.abc import Iterator
from itertools import takewhile

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.terrain.facets import Terrain, area_vectors
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec

SMALLEST_CELL = 0.25
"""Smallest cell size (m) that is chosen automatically; finer maps show single rocks, not a hazard."""

STEPS = (1.0, 2.0, 5.0)
"""Cell sizes that are chosen automatically, times powers of ten: round numbers are easy to count on a map."""

MOST_CELLS = 4_000_000
"""Largest number of cells that is chosen automatically: 2 km by 2 km at 1 m, drawn and written in about 1 s."""

SAMPLE = 100_000
"""Smallest number of facets from which the typical facet size is estimated; if the terrain has fewer, all facets."""

GIGABYTE = 1e9
"""Bytes in a gigabyte, as in the scene's `memory_gb`."""


def raster_over(
    terrain: Terrain, cell: float | None = None, box: tuple[Vec, Vec] | None = None, least: float = 0.0
) -> Raster:
    """Return the raster (local frame) of the hazard maps, which covers a terrain in plan.

    In the input's coordinates, the borders of the cells are whole multiples of the cell size, so that the cells of the
    maps of two surveys of one place coincide.

    Parameters
    ----------
    cell : side of a cell, m; None for a round size of at most half the typical facet size (larger only if `least`,
        `SMALLEST_CELL` or `MOST_CELLS` requires it)
    least : smallest cell (m) if no cell is given; rounded up to a round size
    box : corners of the terrain's box (m, local frame) if they are known already; None to find them here
    """
    low, high = _extent_of(terrain) if box is None else (np.array(corner[:2]) for corner in box)
    if cell is not None:
        return _covering(terrain, low, high, cell)
    finest = max(_finest_cell(terrain), least)
    fitting = (_covering(terrain, low, high, size) for size in round_cells() if size >= finest)
    return next(raster for raster in fitting if raster.nx * raster.ny <= MOST_CELLS)


def _extent_of(terrain: Terrain) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest corner (2,) m of a terrain's box in plan."""
    x, y = terrain.vertices[:, 0], terrain.vertices[:, 1]
    return np.array([x.min(), y.min()]), np.array([x.max(), y.max()])


def _finest_cell(terrain: Terrain) -> float:
    """Return the finest cell size (m) for a terrain: the largest round size up to half of the typical facet size.

    The result is at least `SMALLEST_CELL`. Cells are finer than facets, so that a berm as wide as a facet is visible on
    the map. This is possible because the paths of rocks are known more finely than the ground.
    """
    return round_below(0.5 * typical_size(terrain))


def round_below(size: float) -> float:
    """Return the largest round cell size (m) that does not exceed `size` (m), but at least `SMALLEST_CELL`."""
    return max(takewhile(lambda cell: cell <= size, round_cells()), default=SMALLEST_CELL)


def typical_size(terrain: Terrain) -> float:
    """Return the typical side of a facet (m): the side of a square with the area of two median facets.

    Facets are sampled evenly in the order of the file.
    """
    step = max(len(terrain.triangles) // SAMPLE, 1)
    areas = area_vectors(terrain.vertices, terrain.triangles[::step])
    return math.sqrt(2.0 * float(np.sqrt(np.median((areas**2).sum(axis=1)))))


def round_cells() -> Iterator[float]:
    """Yield round cell sizes (m) in ascending order, without end: 0.25, 0.5, 1, 2, 5, 10, 20, ..."""
    yield SMALLEST_CELL
    yield 2.0 * SMALLEST_CELL
    power = 1.0
    while True:
        yield from (step * power for step in STEPS)
        power *= 10.0


def check_memory(raster: Raster, facets: int, memory_gb: float, bytes_per_cell: int) -> None:
    """Refuse hazard maps that need more memory than the scene allows.

    Parameters
    ----------
    facets : number of facets; the terrain has a map too, with one cell per facet
    memory_gb : memory allowed for all maps, 10^9 bytes
    bytes_per_cell : bytes that a tally keeps for each cell of the raster, and for each facet

    Raises
    ------
    InputError
        The maps need more memory than allowed. The message states both amounts and a cell size that fits. If no cell
        fits, because the facets alone need more, the message states a sufficient `memory_gb`.
    """
    allowed = memory_gb * GIGABYTE / bytes_per_cell - facets
    if raster.nx * raster.ny <= allowed:
        return
    needed = _gigabytes((raster.nx * raster.ny + facets) * bytes_per_cell)
    advice = _advice(raster, facets, allowed, bytes_per_cell)
    raise InputError(
        f"hazard: maps of {raster.nx:,} x {raster.ny:,} cells of {raster.cell:g} m and {facets:,} facets need {needed} "
        f"GB of memory, but memory_gb allows {memory_gb:g} GB; {advice}"
    )


def _advice(raster: Raster, facets: int, allowed: float, bytes_per_cell: int) -> str:
    """Return advice for maps that need too much memory: a cell size that fits, or a sufficient `memory_gb`.

    allowed : largest number of cells that the memory allows; facets, bytes_per_cell : as in `check_memory`
    """
    if allowed < 4:  # even the coarsest raster has 4 cells if a common corner of cells lies on the terrain
        least = _gigabytes((facets + 4) * bytes_per_cell)
        return f"no cell fits, because the facets alone need {least} GB: set memory_gb to at least that"
    fits = next(size for size in round_cells() if size > raster.cell and _most_cells(raster, size) <= allowed)
    return f"a cell of {fits:g} m fits: set cell to {fits:g}, or raise memory_gb"


def _most_cells(raster: Raster, cell: float) -> int:
    """Return the largest number of cells of side `cell` (m) that may be needed to cover the area of a raster."""
    wide, high = (math.ceil(count * raster.cell / cell) + 1 for count in (raster.nx, raster.ny))
    return wide * high


def _gigabytes(size: float) -> str:
    """Return a number of bytes as text in GB, with two significant digits or more, never rounded down."""
    digits = max(1, 1 - math.floor(math.log10(size / GIGABYTE)))
    return f"{math.ceil(size / GIGABYTE * 10**digits) / 10**digits:.{digits}f}"


def _covering(terrain: Terrain, low: FloatArray, high: FloatArray, cell: float) -> Raster:
    """Return the raster with a given cell size over the box from low (2,) to high (2,) m.

    Points on the boundary of the box lie in a cell.
    """
    origin = np.array(terrain.frame.origin[:2])
    first = np.floor((low + origin) / cell)
    # A cell does not contain its upper border; a point on it belongs to the next cell.
    columns, rows = (np.floor((high + origin) / cell) - first).astype(int) + 1
    x, y = first * cell - origin
    return Raster(x=float(x), y=float(y), cell=float(cell), nx=int(columns), ny=int(rows))
