"""Find the outlines of grid cells with the same number, and write them as polygons."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from affine import Affine
from numpy.typing import NDArray
from rasterio.features import shapes

CELLS_THAT_TOUCH = 4
"""Cells of a polygon must share a side (rasterio's connectivity 4), because outlines would cross at a shared corner."""
CELLS_AROUND = 8
"""Cells of a gap may also share only a corner (rasterio's connectivity 8): there is no ground at that corner."""


def cell_outlines(numbers: NDArray[np.int32], transform: Affine) -> dict[int, list[Any]]:
    """Return, for each number except 0, the polygons around the cells that have this number.

    A polygon is a list of rings in plan coordinates (m): its outline, then its holes.

    numbers : (H, W) number of each cell; transform : from columns and rows to plan coordinates
    """
    rings: dict[int, list[Any]] = defaultdict(list)
    there = numbers != 0
    for geometry, number in shapes(numbers, mask=there, connectivity=CELLS_THAT_TOUCH, transform=transform):
        rings[int(number)].append(geometry["coordinates"])
    return dict(rings)


def write_outlines(path: Path, rings: list[Any]) -> None:
    """Write polygons as a GeoJSON file, from which a scene can read a zone; rings : polygons, as in `cell_outlines`."""
    geometry = {"type": "MultiPolygon", "coordinates": rings}
    path.write_text(json.dumps(geometry, allow_nan=False) + "\n", encoding="utf-8")


def enclosed_cell(missing: NDArray[np.bool_]) -> tuple[int, int] | None:
    """Return row and column (from 0) of one cell of an enclosed gap, to name the gap in a message; None without gaps.

    An enclosed gap is a connected group of cells without value that does not reach the boundary of the grid.

    missing : (H, W) True where a cell has no value
    """
    image = missing.astype(np.uint8)
    rows, columns = missing.shape
    for geometry, _ in shapes(image, mask=missing, connectivity=CELLS_AROUND):
        ring = np.array(geometry["coordinates"][0])
        (left, top), (right, bottom) = ring.min(axis=0), ring.max(axis=0)
        if min(left, top) > 0 and right < columns and bottom < rows:
            first = ring[ring[:, 1] == top, 0].min()  # the leftmost corner of the top row's cells of this gap
            return int(top), int(first)
    return None
