"""Divide a region in a plane into triangles, also where rounding makes the region almost invalid."""

import shapely


def triangles_of(region: shapely.Polygon) -> shapely.GeometryCollection:
    """Return triangles that fill a region, as polygons whose corners are corners of the region.

    GEOS cannot fill some regions whose rings almost touch. Then the result has the triangles of the Delaunay
    triangulation of the corners whose centroids lie in the region: they fill it except for slivers. There may be none.
    """
    try:
        return shapely.constrained_delaunay_triangles(region)
    except shapely.errors.GEOSException:
        parts = shapely.get_parts(shapely.delaunay_triangles(region))
        return shapely.geometrycollections(parts[shapely.contains(region, shapely.centroid(parts))])
