"""Measure how much of a polygon lies on the terrain in plan, to refuse or warn about misplaced polygons."""

import numpy as np
from shapely.geometry import MultiPolygon

from rpf3d_core.formats.polygons import local_plan, plan_triangles
from rpf3d_core.terrain.clipping import facets_within
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.plan_view import Window, seen_from_above
from rpf3d_core.terrain.zones import covered, in_plan

PIXELS = 500
"""Number of pixels along the longer side of the polygons' box; enough to measure a share to within about 1 %."""


def lies_off(terrain: Terrain, polygons: MultiPolygon) -> bool:
    """Return True if no part of the polygons lies on the terrain; polygons : in plan coordinates of the input."""
    plan = in_plan(terrain.frame, terrain.vertices)
    low_x, low_y, high_x, high_y = polygons.bounds
    near = plan[(plan[:, 0] >= low_x) & (plan[:, 0] <= high_x) & (plan[:, 1] >= low_y) & (plan[:, 1] <= high_y)]
    if covered(polygons, near).any():
        return False
    prisms = local_plan(terrain.frame, plan_triangles(polygons))  # the polygons may still lie within one facet
    return not len(facets_within(terrain.vertices[terrain.triangles], prisms))


def covered_share(terrain: Terrain, polygons: MultiPolygon) -> float:
    """Return the share (-) of the polygons' area that lies on the terrain; polygons : in plan coordinates of the input.

    The share is measured with pixels, to within about 1 %. A part over a hole does not count. For polygons too
    thin to contain the centre of a pixel, the result is the share of their box.
    """
    corners = local_plan(terrain.frame, np.reshape(polygons.bounds, (2, 2)))
    (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
    ground = seen_from_above(terrain, Window(left=left, right=right, bottom=bottom, top=top), PIXELS).facet >= 0
    rows, columns = ground.shape
    x = left + (np.arange(columns) + 0.5) / columns * (right - left)
    y = bottom + (np.arange(rows) + 0.5) / rows * (top - bottom)
    centres = np.stack([*np.meshgrid(x, y), np.zeros(ground.shape)], axis=-1).reshape(-1, 3)
    inside = covered(polygons, in_plan(terrain.frame, centres))
    # A thin polygon may contain no pixel centre; then all pixels of its box are used.
    return float(ground.ravel()[inside if inside.any() else slice(None)].mean())


def extents(terrain: Terrain, plan: FloatArray) -> str:
    """Return the ranges of coordinates of some points and of the terrain in plan, as text for a message.

    plan : (..., 2) m, the points, in plan coordinates of the input
    """
    return f"it goes {_extent(plan)}, the terrain {_extent(in_plan(terrain.frame, terrain.vertices))}"


def plain(number: float) -> str:
    """Return a coordinate as a plain decimal: to the millimetre, or to six decimals if it may be in degrees."""
    text = f"{number:.{6 if abs(number) <= 180.0 else 3}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _extent(plan: FloatArray) -> str:
    points = plan.reshape(-1, 2)
    low, high = (", ".join(map(plain, corner)) for corner in (points.min(axis=0).tolist(), points.max(axis=0).tolist()))
    return f"from ({low}) to ({high})"
