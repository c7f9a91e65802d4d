"""Make a terrain from points and triangles that do not come from a file, such as a survey received over ROS."""

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray, Frame
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.welding import weld
from rpf3d_core.terrain.mesh.winding import repair_winding
from rpf3d_core.terrain.mesh.zero_area import NO_AREA_AT_ALL, without_area


def mesh_terrain(vertices: FloatArray, triangles: IntArray, zone: str, weld_tolerance: float | None = None) -> Terrain:
    """Return the terrain of a survey, in one zone, after welding its mesh (optional) and repairing its winding.

    The origin of the local frame is the middle of the vertices' box, in whole metres.

    vertices : (V, 3) m, z up; triangles : (F, 3); zone : name of the zone
    weld_tolerance : vertices at most this far apart (m) become one vertex; None if the mesh is already welded

    Raises
    ------
    TerrainError
        If there is no triangle, no facet has an area, or a vertex is not finite.
    """
    if len(triangles) == 0:
        raise TerrainError("the terrain has no triangles; it needs at least one")
    if not np.isfinite(vertices).all():
        raise TerrainError("the terrain has a vertex that is NaN or infinite; every coordinate must be a finite number")
    x, y, z = np.round(0.5 * (vertices.min(axis=0) + vertices.max(axis=0))).tolist()
    frame = Frame((x, y, z))
    local = frame.points_to_local(vertices)
    if weld_tolerance is not None:
        local, index = weld(local, weld_tolerance)
        triangles = index[triangles]
    winding = repair_winding(local, triangles, edges_of(triangles, len(local)))
    if without_area(local, winding.triangles, winding.areas).all():
        raise TerrainError(f"this cannot be a terrain: {NO_AREA_AT_ALL}")
    return Terrain(local, winding.triangles, np.zeros(len(triangles), dtype=np.int32), (zone,), frame)
