"""Find the outlines of grid cells that have the same number, along the borders of the cells."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from affine import Affine
from numpy.typing import NDArray
from rasterio.features import shapes

CELLS_THAT_TOUCH = 4
"""Connectivity of polygons: cells that share a border are one polygon. Cells that share only a corner are two, because
their outlines would cross there."""
CELLS_AROUND = 8
"""Connectivity of holes: cells of a hole that share only a corner are one hole, because no square there has ground."""


def cell_outlines(numbers: NDArray[np.int32], transform: Affine) -> dict[int, list[Any]]:
    """Return the rings (plan coordinates, m) of the polygons around the cells (H, W) of each number except 0."""
    rings: dict[int, list[Any]] = defaultdict(list)
    there = numbers != 0
    for geometry, number in shapes(numbers, mask=there, connectivity=CELLS_THAT_TOUCH, transform=transform):
        rings[int(number)].append(geometry["coordinates"])
    return dict(rings)


def write_outlines(path: Path, rings: list[Any]) -> None:
    """Write rings as one GeoJSON MultiPolygon, the format in which a scene's zones are read."""
    geometry = {"type": "MultiPolygon", "coordinates": rings}
    path.write_text(json.dumps(geometry, allow_nan=False) + "\n", encoding="utf-8")


def enclosed_cell(missing: NDArray[np.bool_]) -> tuple[int, int] | None:
    """Return row and column of a cell in an enclosed hole of a grid; None if all holes reach the grid's edge.

    missing : (H, W) True where a cell has no value
    """
    image = missing.astype(np.uint8)
    rows, columns = missing.shape
    for geometry, _ in shapes(image, mask=missing, connectivity=CELLS_AROUND):
        ring = np.array(geometry["coordinates"][0])
        (left, top), (right, bottom) = ring.min(axis=0), ring.max(axis=0)
        if min(left, top) > 0 and right < columns and bottom < rows:
            row = int(top)
            return row, int(np.flatnonzero(missing[row, int(left) : int(right)])[0] + left)
    return None
