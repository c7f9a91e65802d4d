"""Divide a region in a plane into triangles, also where rounding makes the region almost invalid."""

import numpy as np
import shapely

FILLED = 1e-6
"""Largest difference between the area of a region and the area of its triangles, divided by the area of the region."""
HALVINGS = 8
"""Largest number of times that the sides of a region are halved, until its triangles fill it."""


def triangles_of(region: shapely.Polygon) -> shapely.GeometryCollection:
    """Return triangles that fill a region, as polygons; there may be none if the region is nearly a line.

    The corners of the triangles are corners of the region. GEOS cannot divide some regions whose rings almost touch.
    Then the sides of the region are halved until the Delaunay triangles of its corners fill it, so corners lie on the
    sides, too. If they do not fill it after HALVINGS times, the triangles inside the region are returned.
    """
    try:
        return shapely.constrained_delaunay_triangles(region)
    except shapely.errors.GEOSException:
        return _delaunay_triangles_of(region)


def _delaunay_triangles_of(region: shapely.Polygon) -> shapely.GeometryCollection:
    rings = shapely.get_coordinates(shapely.get_rings(region))
    longest, inside = float(np.ptp(rings, axis=0).max()), np.empty(0, dtype=object)
    for halving in range(HALVINGS + 1):
        cut = region if halving == 0 else shapely.segmentize(region, longest / 2.0**halving)
        parts = shapely.get_parts(shapely.delaunay_triangles(cut))
        inside = parts[shapely.contains(region, shapely.centroid(parts))]
        if fills(inside, region):
            return shapely.geometrycollections(inside)
    return shapely.geometrycollections(inside[shapely.covered_by(inside, region)])


def fills(triangles: "np.ndarray[tuple[int], np.dtype[np.object_]]", region: shapely.Polygon) -> bool:
    """Return True if triangles, (T,) polygons that do not overlap, have the area of a region."""
    return bool(abs(shapely.area(triangles).sum() - region.area) <= FILLED * region.area)
