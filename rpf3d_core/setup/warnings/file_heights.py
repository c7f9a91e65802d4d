"""Compare the heights in files of sources with the ground, although `above_ground` replaces these heights.

A difference shows that z points down in the file or in the terrain, that one of them is in another unit or datum, or
that the source lies next to its crest.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.formats.polylines import read_lines_with_heights
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.releases import SourceSpec, source_points
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.frame import FloatArray, Frame, Up

MOST_DIFFERENT = 2.0
"""Largest median height (m) of points above or below the ground, in addition to `above_ground`, without a warning."""
MOST_POINTS = 200
"""Approximate number of points of a source that are compared."""
AROUND = ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""Shifts in plan (m) from a point to the places where ground is searched: points may lie a little beyond a crest."""


def height_warnings(scene: Scene, engine: Engine, frame: Frame) -> Iterator[str]:
    """Yield a warning for each file of a source whose heights, replaced by `above_ground`, lie far off the ground.

    frame : frame of the terrain, in whose local coordinates the engine searches
    """
    for number, spec in enumerate(scene.sources):
        path = spec.line if isinstance(spec.line, Path) else spec.points_file
        if path is None or spec.above_ground is None:
            continue
        points = _points_with_heights(spec, scene.terrain.up)
        elevation, straight, least = _above_ground(points[:: max(1, len(points) // MOST_POINTS)], engine, frame)
        near = MOST_DIFFERENT + spec.above_ground
        if not len(least) or abs(np.median(least)) <= near:
            continue
        ground = elevation - straight
        is_mirrored = abs(np.median(elevation + ground)) <= near < abs(np.median(ground))
        why = (
            "does z point down in the file or in the terrain, or is one of them in another datum" if is_mirrored
            else "is the file or the terrain in another unit or datum, or does the source lie next to its crest"
        )  # fmt: skip
        median = float(np.median(straight))
        key = "line" if spec.line is not None else "points_file"
        most, middle = (three_figures(float(each)) for each in (np.abs(straight).max(), abs(median)))
        yield (
            f"`sources[{number}].{key}` of {spec.name!r}: the heights in {path.name} are {middle} m "
            f"{'above' if median > 0.0 else 'below'} the ground in the median, and differ from it by up to {most} m: "
            f"{why}? The heights are not used, because the source states `above_ground`"
        )


def _points_with_heights(spec: SourceSpec, up: Up) -> FloatArray:
    """Return the points (P, 3) m in the file of a source that have heights; (0, 3) if the file has no heights.

    Heights that are all 0 count as no heights. Lines have heights only if z points up.
    """
    height = 2 if up == "z" else 1
    if not isinstance(spec.line, Path):
        points = source_points(spec, up)
    elif up == "z":
        points = np.concatenate(read_lines_with_heights(spec.line))
    else:
        return np.empty((0, 3))
    points = points[np.isfinite(points[:, height])]
    return points if points[:, height].any() else np.empty((0, 3))


def _above_ground(points: FloatArray, engine: Engine, frame: Frame) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the elevation and two heights above the ground (N,) m of points; points off the terrain are left out.

    Heights are negative below the ground. The first height is above the ground at the point itself. The second height
    is above the ground at one of the places AROUND the point: the place where the height is closest to 0. Over a hole,
    the first height equals the second.

    points : (P, 3) m, in the axes of the input
    """
    x = frame.points_to_local(points)
    over = float(engine.facets.high[2]) + 1.0
    columns = []
    for across, along in AROUND:
        top = np.array(x) + np.array([across, along, 0.0])
        top[:, 2] = over
        found = engine.ground_below(top)
        columns.append(np.where(found[:, 1] < 0, np.nan, x[:, 2] - (over - found[:, 0])))
    heights = np.column_stack(columns)
    known = np.isfinite(heights).any(axis=1)
    heights, elevation = heights[known], x[known, 2] + frame.origin[2]
    least: FloatArray = heights[np.arange(len(heights)), np.nanargmin(np.abs(heights), axis=1)]
    return elevation, np.where(np.isnan(heights[:, 0]), least, heights[:, 0]), least
