"""Find terrain files whose coordinates lost digits in single precision (float32).

Single precision has 24 binary digits, so its steps are 0.5 m at a northing of 7,654,321 m.
"""

from pathlib import Path

import numpy as np

from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.terrain.frame import FloatArray

LEAST_LOSS = 0.01
"""Error of a vertex, as a share (-) of the median edge, above which the error is reported.

An error of this size turns a facet by 0.6 degrees.
"""
MOST_FACETS = 100_000
"""Largest number of facets that are used to compute the median edge."""


def lost_precision(path: Path, surface: FileMesh, unit: float = 1.0) -> str | None:
    """Return a sentence with the error due to single precision, and what to do; None if the error is negligible.

    surface : with its points in the unit of the file; unit : length (m) of this unit, such as 0.001
    """
    step = unit * _steps(surface)
    loss, edge = 0.5 * float(np.linalg.norm(step)), unit * _median_edge(surface)
    if loss <= LEAST_LOSS * edge:
        return None
    axis = int(step.argmax())
    at = unit * float(np.abs(surface.points[:, axis]).max())
    return (
        f"{path.name}: its coordinates have single precision, so steps of {step[axis]:g} m at {at:.0f} m: vertices are "
        f"off by up to {loss:.2g} m, and the median edge is {edge:.2g} m; slopes are wrong. Export it in double "
        "precision (DXF, LandXML, OMF, a PLY of `double`), or subtract an origin from all inputs before the export"
    )


def _steps(surface: FileMesh) -> FloatArray:
    """Return the step of single precision at the largest coordinate of each axis (3,), in the unit of the file.

    The step is 0 for an axis whose coordinates are in double precision, and were never rounded to single precision.
    """
    largest = np.array([max(abs(float(c.min())), abs(float(c.max()))) for c in surface.points.T])
    step = np.spacing(largest.astype(np.float32)).astype(float)
    if surface.points.dtype == np.float32:
        return step
    return np.array([s if _was_single(column, s) else 0.0 for column, s in zip(surface.points.T, step, strict=True)])


def _was_single(column: FloatArray, step: float) -> bool:
    """Return True if numbers (N,) in double precision were rounded to single precision earlier, such as by an export.

    Two conditions must hold. Every number is also a number of single precision. And at least one number is not a
    multiple of 2 * step: else the numbers lie on a grid that is coarser than single precision, and nothing was lost.

    step : step of single precision at the largest number, in the unit of the numbers
    """
    single = column.astype(np.float32)
    return bool((single == column).all() and (np.mod(column, 2.0 * step) != 0.0).any())


def _median_edge(surface: FileMesh) -> float:
    """Return the median length of the sides of facets, in the unit of the file, from at most MOST_FACETS facets."""
    points = surface.points
    every = -(-(len(points) // 3 if surface.triangles is None else len(surface.triangles)) // MOST_FACETS)
    if surface.triangles is None:
        corners = points.reshape(-1, 3, 3)[::every].astype(float)
    else:
        corners = points[surface.triangles[::every]].astype(float)
    return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))
