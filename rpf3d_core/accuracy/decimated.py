"""Reduce the number of triangles of a terrain, as in a coarser survey, with VTK's quadric decimation."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

from rpf3d_core.detection.vtk_closest import closest_by_vtk
from rpf3d_core.detection.vtk_locator import VtkLocator
from rpf3d_core.formats.vtk_mesh import triangle_mesh
from rpf3d_core.terrain.facets import Facets, Terrain, facets_of
from rpf3d_core.terrain.frame import FloatArray


def decimated(terrain: Terrain, share: float) -> Terrain:
    """Return the terrain with fewer triangles, to measure the error of a coarser survey; zones are kept.

    Each new triangle gets the zone of the nearest original facet.

    share : number of triangles after the decimation divided by the number before (-), approximate

    Sources
    -------
    Garland & Heckbert 1997, SIGGRAPH 97:209-216: edges are collapsed in the order of least change of the surface.
    """
    vertices, triangles = decimated_mesh(terrain.vertices, terrain.triangles, share)
    zone = terrain.zone[_nearest_facets(terrain, vertices[triangles].mean(axis=1))]
    return Terrain(vertices, triangles, np.ascontiguousarray(zone), terrain.zones, terrain.frame)


def decimated_mesh(
    vertices: FloatArray, triangles: NDArray[np.integer], share: float
) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return vertices (V, 3) m and triangles (F, 3) of a mesh with fewer triangles; `share` as in `decimated`."""
    decimation = vtkQuadricDecimation()
    decimation.SetInputData(triangle_mesh(vertices, triangles))
    decimation.SetTargetReduction(1.0 - share)
    decimation.Update()
    mesh: Any = decimation.GetOutput()
    points = np.array(vtk_to_numpy(mesh.GetPoints().GetData()), dtype=float)
    facets = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(np.int32)
    used, facets = np.unique(facets, return_inverse=True)
    return points[used], np.ascontiguousarray(facets.reshape(-1, 3), dtype=np.int32)


def _nearest_facets(terrain: Terrain, points: FloatArray) -> NDArray[np.int64]:
    """Return the number (N,) of the terrain's facet that is closest to each of N points (N, 3) m."""
    facets: Facets = facets_of(terrain)
    locator = VtkLocator(facets)
    anywhere = 2.0 * float(np.linalg.norm(np.subtract(facets.high, facets.low)))
    return np.array([closest_by_vtk(locator, facets, (x, y, z), anywhere).facet for x, y, z in points.tolist()])
