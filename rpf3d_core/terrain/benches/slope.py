"""Make the mesh of a slope of benches: rows of points along the faces, two triangles for each cell between them."""

import numpy as np

from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.benches.profile import FACE, Profile, profile_of
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.pit.relief import OCTAVES, drawn_waves, height_of_waves

MIDDLE = 0.5
"""Share (-) of the upper edge of a face that a source along this edge uses: the middle part of the edge.

The rest remains free on both sides, so that rocks that fly sideways still land on the slope.
"""


def benches_terrain(benches: Benches) -> Terrain:
    """Return a slope of benches as a mesh; the same parameters always give exactly the same mesh.

    Zones: `crest`, `face_1` (the uppermost), `berm_1`, `face_2` and so on down, `floor`. The upper edge is at x = 0,
    the floor at z = 0; x points away from the faces, and y = 0 is the middle of the slope. Vertical faces are
    vertical facets; a rough vertical face may overhang.
    """
    profile = profile_of(benches)
    columns = _columns(benches)
    rows = [_row(benches, profile, row, columns) for row in range(len(profile.points))]
    triangles = _triangles(len(rows), len(columns))
    zone = np.repeat(profile.zone, 2 * (len(columns) - 1))
    return Terrain(vertices=np.concatenate(rows), triangles=triangles, zone=zone, zones=profile.zones)


def brow_of(benches: Benches, face: int) -> FloatArray:
    """Return points (P, 3) m along the middle half (`MIDDLE`) of a face's upper edge (brow), for a source of rocks.

    All points are on edges of the mesh.

    face : number of the face, from 1 at the top
    """
    profile = profile_of(benches)
    half = 0.5 * MIDDLE * benches.width
    columns = _columns(benches)
    within = columns[np.abs(columns) < half]
    edge = _row(benches, profile, profile.edges[profile.zones.index(f"{FACE}{face}")], columns)
    y = np.concatenate([[-half], within, [half]])
    return np.stack([np.full_like(y, edge[0, 0]), y, np.interp(y, columns, edge[:, 2])], axis=1)


def _columns(benches: Benches) -> FloatArray:
    """Return the y coordinates (C,) m of the columns of points; y runs along the faces, 0 is the middle."""
    half = 0.5 * benches.width
    return np.linspace(-half, half, benches.cells(benches.width) + 1)


def _row(benches: Benches, profile: Profile, row: int, columns: FloatArray) -> FloatArray:
    """Return the points (C, 3) m of one row along the faces, relief included.

    row : number of the profile's point at which the row lies; columns : (C,) m, y coordinates
    """
    (x, z), (nx, nz) = profile.points[row], profile.normal[row]
    points = np.stack([np.full_like(columns, x), columns, np.full_like(columns, z)], axis=1)
    if benches.roughness:
        random = np.random.Generator(np.random.Philox(key=benches.seed, counter=1))
        waves = drawn_waves(random, OCTAVES, plan=False)
        height = benches.roughness * profile.rough[row] * height_of_waves(waves, *points.T)
        points += height[:, None] * np.array([nx, 0.0, nz])
    return points


def _triangles(rows: int, columns: int) -> IntArray:
    """Return the triangles (F, 3) between all points, counter-clockwise seen from the free side.

    rows, columns : numbers of rows and columns of points; points are numbered row by row
    """
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    near = (row * columns + column).ravel()
    far = near + columns
    pairs = np.stack([near, far, far + 1, near, far + 1, near + 1], axis=1)
    return pairs.reshape(-1, 3).astype(np.int32)
