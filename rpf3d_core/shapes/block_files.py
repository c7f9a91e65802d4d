"""Read the shape of a rock from the mesh of a scanned block, such as an STL, OBJ, PLY or VTP file.

All formats in `formats.meshes.MESH_READERS` are read. A file that states no unit is in metres.

The rock takes the shape of the convex hull of a few corners of the mesh, because contact with the ground costs time for
each corner. The findings report every way in which the hull differs from the file. Facets that pass through each other
are not searched for; they are reported only if the volume of the facets is larger than the volume of the hull.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.formats.meshes import MESH_READERS
from rpf3d_core.formats.surface import FileMesh, in_metres, usable
from rpf3d_core.formats.units import LENGTHS, METRE
from rpf3d_core.shapes.directions import fibonacci_sphere
from rpf3d_core.shapes.polyhedron import SAME_PLACE, Polyhedron, hull_volume, polyhedron_of, volume_and_centre
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.mesh.edges import collapsed, edges_of, shared_by_two
from rpf3d_core.terrain.mesh.welding import weld

FEWEST_CORNERS, MOST_CORNERS = 4, 200
"""Limits of the number of corners: a solid has at least 4, and each further corner makes the simulation slower."""

AS_CONVEX = 0.001
"""Largest difference between the volumes of a solid and its hull, as a share (-), if the solid counts as convex."""


class Solid(NamedTuple):
    """The welded mesh of a block: vertices (V, 3) m relative to the mean of the file's points, and triangles (T, 3).

    collapsed : number of facets left out because two of their corners coincide
    repeated : number of facets left out because they repeat the corners of another facet
    """

    vertices: FloatArray
    triangles: NDArray[np.int32]
    collapsed: int
    repeated: int


def read_block(path: Path, corners: int) -> tuple[Polyhedron, tuple[str, ...]]:
    """Return the shape of a rock from a mesh file, and the findings on the file and the shape.

    The shape is a convex hull with at most `corners` corners: the outermost points of the mesh in `corners` directions
    of a Fibonacci sphere, in the axes of the file. The shape is then turned to its principal axes. The volume of this
    hull is below the volume of the hull of all points. For the four blocks of the Authume quarry, the ratio is 89 to
    91 % with 40 directions, 96 % with 100, and 97 to 99 % with 200.

    The findings are sentences, without the name of the file. There are no findings if the mesh is a closed, convex
    solid, and if the hull has `corners` corners and the volume of the mesh.

    Raises
    ------
    InputError
        The format is unknown; the file is missing or damaged; the mesh has no facets, is flat or not finite; or
        `corners` is below 4 or above 200. The message names the file.
    """
    if not FEWEST_CORNERS <= corners <= MOST_CORNERS:
        raise InputError(f"{path}: {corners} corners are asked for; choose {FEWEST_CORNERS} to {MOST_CORNERS}")
    mesh = _mesh(path)
    solid = _solid(path, in_metres(mesh, mesh.unit))
    try:
        whole = hull_volume(solid.vertices)
        polyhedron = polyhedron_of(_outermost(solid.vertices, corners), path.stem)
    except InputError as fault:
        raise InputError(f"{path}: {fault}") from fault
    findings = (*_unit_findings(mesh), *_mesh_findings(solid, whole), *_hull_findings(polyhedron, corners, whole))
    return polyhedron, findings


def _mesh(path: Path) -> FileMesh:
    """Return the content of a mesh file; refuse unknown formats, missing files and files without facets."""
    reader = MESH_READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"{path}: has the unknown format {path.suffix!r}; a rock is read from {', '.join(MESH_READERS)}"
        )
    if not path.is_file():
        raise InputError(f"{path}: is not a file; give the path of a mesh")
    mesh = reader(path)
    if len(mesh.points) == 0 or (mesh.triangles is not None and len(mesh.triangles) == 0):
        raise InputError(f"{path}: holds no facets; a rock needs a closed surface of triangles")
    return usable(path, mesh, LENGTHS[mesh.unit or METRE][1])


def _unit_findings(mesh: FileMesh) -> Iterator[str]:
    """Yield a finding if the file of a mesh states a unit other than metres."""
    if mesh.unit not in (None, METRE):
        yield f"the file states that it is in {LENGTHS[mesh.unit][0]}; converted to metres"


def _solid(path: Path, mesh: FileMesh) -> Solid:
    """Return the welded mesh, without facets that have coinciding corners or repeat the corners of another facet."""
    points = np.asfortranarray(mesh.points, dtype=np.float64)
    extent = float(np.ptp(points, axis=0).max())
    vertices, index = weld(points - points.mean(axis=0), SAME_PLACE * extent)
    named = np.arange(len(points)) if mesh.triangles is None else mesh.triangles
    triangles = index[named.reshape(-1, 3)]
    with_area = triangles[~collapsed(triangles)]
    if len(with_area) == 0:
        raise InputError(f"{path}: holds no facets with an area; a rock needs a closed surface of triangles")
    _, first = np.unique(np.sort(with_area, axis=1), axis=0, return_index=True)
    return Solid(
        vertices=vertices,
        triangles=np.ascontiguousarray(with_area[np.sort(first)]),
        collapsed=len(triangles) - len(with_area),
        repeated=len(with_area) - len(first),
    )


def _outermost(points: FloatArray, count: int) -> FloatArray:
    """Return the points that lie farthest out in `count` evenly spread directions: at most `count` points, (N, 3) m."""
    x, y, z = points.T
    found = {int(np.argmax(x * d[0] + y * d[1] + z * d[2])) for d in fibonacci_sphere(count).tolist()}
    outermost: FloatArray = points[sorted(found)]
    return outermost


def _mesh_findings(solid: Solid, hull: float) -> Iterator[str]:
    """Yield sentences on faults of a mesh; hull : volume of the hull of all its points, m3."""
    if solid.collapsed:
        yield f"{_count(solid.collapsed, 'facet has', 'facets have')} no area; left out"
    if solid.repeated:
        yield f"{_count(solid.repeated, 'facet repeats', 'facets repeat')} the corners of another facet; left out"
    edges = edges_of(solid.triangles, len(solid.vertices))
    if single := int((edges.uses == 1).sum()):
        yield f"the solid is open: {_count(single, 'edge has', 'edges have')} one facet only"
    if several := int((edges.uses > 2).sum()):
        yield f"{_count(several, 'edge has', 'edges have')} more than two facets"
    if (parts := _parts(solid)) > 1:
        yield f"the mesh has {parts} separate parts; the hull encloses all of them"
    if opposed := int((~shared_by_two(edges)[2]).sum()):
        yield (
            f"{_count(opposed, 'edge joins', 'edges join')} two facets of opposite winding; the volume of the solid is "
            "not compared with its hull"
        )
    else:
        yield from _volume_findings(volume_and_centre(solid.vertices, solid.triangles.tolist())[0] / hull)


def _count(number: int, one: str, several: str) -> str:
    """Return a number with the words that follow it in the singular (`one`) or the plural (`several`)."""
    return f"{number:,} {one if number == 1 else several}"


def _parts(solid: Solid) -> int:
    """Return the number of parts of a mesh; different parts have no vertex in common."""
    a, b, c = solid.triangles.T
    part = components(len(solid.vertices), np.concatenate([a, b]), np.concatenate([b, c]))
    return len(np.unique(part[a]))


def _volume_findings(share: float) -> Iterator[str]:
    """Yield sentences on a solid that is inside out, not convex, or has overlapping facets.

    share : volume of the solid over the volume of its hull (-); negative if the solid is inside out
    """
    if share < 0.0:
        yield "the solid is inside out: its facets are clockwise as seen from outside; the hull is not affected"
    if abs(share) < 1.0 - AS_CONVEX:
        yield f"the solid is not convex: it fills {100.0 * abs(share):.1f} % of its hull, and the rock is the hull"
    if abs(share) > 1.0 + AS_CONVEX:
        yield f"facets overlap: they enclose {100.0 * abs(share):.1f} % of the volume of the hull; the rock is the hull"


def _hull_findings(polyhedron: Polyhedron, asked: int, hull: float) -> Iterator[str]:
    """Yield sentences on the corners and the volume of the rock's shape.

    asked : requested number of corners; hull : volume of the hull of all points of the mesh, m3
    """
    if len(polyhedron.corners) < asked:
        yield f"the rock has {len(polyhedron.corners)} corners; {asked} were asked for"
    if polyhedron.volume < (1.0 - AS_CONVEX) * hull:
        yield f"the rock has {100.0 * polyhedron.volume / hull:.1f} % of the volume of the hull of all points"
