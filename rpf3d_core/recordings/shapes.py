"""Prepare meshes and lines for the rerun viewer, which gives a line one colour, and a mesh one colour per vertex."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.colours import Colours, zone_colours
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.terrain.facets import Terrain

SPEED_STEPS = 16
"""Number of colours from speed 0 to the highest speed.

A path is cut where its colour changes, because rerun draws each line in one colour.
"""

BLOCK = 2**14
"""Number of facets whose areas are computed in one step, so that they fit into the processor's cache."""


class ColouredMesh(NamedTuple):
    """A mesh with a colour at each vertex, as the viewer draws it.

    vertices : (N, 3) m and normals : (N, 3) unit vectors, both float32; triangles : (F, 3); colours : (N, 3) sRGB
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32]
    colours: Colours


def coloured_mesh(terrain: Terrain) -> ColouredMesh:
    """Return the terrain as a mesh for the viewer, with one colour for each zone and sharp borders between zones.

    Vertices at zone borders are duplicated.
    """
    return parted_mesh(terrain.vertices, terrain.triangles, terrain.zone, zone_colours(terrain.zones))


def parted_mesh(
    vertices: FloatArray, triangles: NDArray[np.integer], kind: NDArray[np.integer], colours: Colours
) -> ColouredMesh:
    """Return facets as a mesh for the viewer in which each facet has exactly the colour of its kind, such as its zone.

    A vertex of facets of several kinds is duplicated for each kind. A vertex without facets is left out.

    vertices : (V, 3) m; triangles : (F, 3); kind : (F,) index into `colours` (K, 3) sRGB
    """
    vertex, own_kind, parted = _parted(triangles, kind, len(vertices))
    own = vertices[vertex]
    return ColouredMesh(
        vertices=own.astype(np.float32),
        triangles=parted.astype(np.uint32),
        normals=_vertex_normals(own, parted).astype(np.float32),
        colours=colours[own_kind],
    )


def _parted(
    triangles: NDArray[np.integer], kind: NDArray[np.integer], count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the distinct pairs (vertex, kind of a facet with this vertex), and the facets as indices into the pairs.

    The three arrays are: the vertices (N,) of the pairs; the kinds (N,) of the pairs; the facets (F, 3). The pairs are
    ordered by vertex. Most vertices have facets of one kind only. Only the other vertices are sorted: sorting all
    corners of a large mesh would take most of the time of a recording.

    triangles : (F, 3) vertices of the facets; kind : (F,) kind of each facet; count : number of vertices
    """
    last, used, mixed = np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count, dtype=bool)
    for column in triangles.T:
        last[column], used[column] = kind, 1
    for column in triangles.T:
        mixed[column[last[column] != kind]] = True
    several = mixed[triangles]
    kinds = int(kind.max(initial=0)) + 1
    keys, place = np.unique((triangles * np.int64(kinds) + kind[:, None])[several], return_inverse=True)
    np.add.at(used, keys // kinds, 1)
    used[mixed] -= 1
    begin = np.cumsum(used) - used
    vertex = np.repeat(np.arange(count), used)
    own_kind = last[vertex]
    first = np.searchsorted(keys // kinds, keys // kinds)
    at = begin[keys // kinds] + np.arange(len(keys)) - first
    own_kind[at] = keys % kinds
    parted = begin[triangles]
    parted[several] = at[place]
    return vertex, own_kind, parted


def strips_by_speed(samples: PathSamples, fastest: float) -> tuple[list[FloatArray], FloatArray]:
    """Cut paths into lines of nearly constant speed, so that each line can have one colour.

    Return L lines, (N, 3) m each, and the speed (L,) m/s for the colour of each line: the middle of one of SPEED_STEPS
    (16) ranges. Each line ends where the next line of the same rock begins.

    fastest : highest speed of the colour scale (m/s)
    """
    step = np.floor(samples.speed / max(fastest, np.finfo(float).tiny) * SPEED_STEPS).clip(0, SPEED_STEPS - 1)
    new = np.zeros(len(step), dtype=bool)
    new[samples.starts] = True
    cut = new.copy()
    cut[1:] |= step[1:] != step[:-1]
    begins = np.flatnonzero(cut)
    ends = np.append(begins, len(step))[1:] if len(step) else begins
    # A line continues to the first point of the next line, unless that point belongs to another rock.
    reach = np.where(ends < len(step), ends + ~np.append(new, True)[ends], ends)
    strips = [samples.x[begin:end] for begin, end in zip(begins, reach, strict=True) if end - begin > 1]
    speed = (step[begins] + 0.5) / SPEED_STEPS * fastest
    return strips, speed[reach - begins > 1]


def _vertex_normals(vertices: FloatArray, triangles: NDArray[np.int64]) -> FloatArray:
    """Return unit normals (N, 3) at vertices (N, 3) m, for shading.

    The normal of a vertex is the area-weighted mean of the normals of its facets; the normal of a vertex without facets
    is 0.
    """
    area, corner = _areas(vertices, triangles), triangles.ravel()
    weights, total = np.empty((len(triangles), 3)), np.empty((len(vertices), 3))
    for axis in range(3):
        weights[:] = area[axis][:, None]
        total[:, axis] = np.bincount(corner, weights.ravel(), len(vertices))
    length = np.linalg.norm(total, axis=1)[:, None]
    return np.asarray(np.divide(total, length, out=np.zeros_like(total), where=length > 0.0))


def _areas(vertices: FloatArray, triangles: NDArray[np.int64]) -> FloatArray:
    """Return the normals (3, F) m^2 of facets; the length of each normal is twice the area of the facet.

    Normals are computed in blocks, because the first use of new memory takes longer than the arithmetic.
    """
    area = np.empty((3, len(triangles)))
    for begin in range(0, len(triangles), BLOCK):
        a, b, c = (vertices[corner] for corner in triangles[begin : begin + BLOCK].T)
        area[:, begin : begin + BLOCK] = np.cross(b - a, c - a).T
    return area
