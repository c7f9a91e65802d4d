"""Close the narrow seams of a mesh survey, in the memory of a live terrain."""

import numpy as np

from rpf3d_core.jit.memory import Memory
from rpf3d_core.terrain.closed_seams import with_closed_seams
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.grid_rows import Mesh
from rpf3d_core.terrain.mesh.edges import edges_of


def closed_mesh(mesh: Mesh, memory: Memory) -> tuple[Mesh, int]:
    """Return a mesh after its narrow seams were closed, and the number of vertices at which seams were closed.

    The vertices do not change. Without narrow seams, the given mesh itself is returned (`terrain.closed_seams`).

    mesh : with consistent winding; memory : allocates the array of the triangles
    """
    zone = np.zeros(len(mesh.triangles), np.int32)
    terrain = Terrain(mesh.vertices, mesh.triangles, zone, ("",), Frame(mesh.origin))
    closed = with_closed_seams(terrain, edges_of(mesh.triangles, len(mesh.vertices)))
    if not closed.seams.closed:
        return mesh, 0
    triangles = memory("triangles", closed.terrain.triangles.size, np.int32).reshape(-1, 3)
    triangles[:] = closed.terrain.triangles
    return mesh._replace(triangles=triangles), closed.seams.closed
