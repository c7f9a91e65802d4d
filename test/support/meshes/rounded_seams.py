"""Make meshes with T-junctions whose coordinates were rounded, and judge such meshes by counting their sides.

Nothing here uses the code that finds or closes seams.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
from flights.scenes_of_facets import grid_triangles, terrain_of

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

Draw = np.random.Generator


def with_t_junctions(draw: Draw, whole: Terrain, share: float = 0.4, most: int = 3) -> Terrain:
    """Return a terrain in which some sides of facets have vertices that the neighbouring facet does not have.

    A facet with such vertices becomes facets around its centroid. Both facets at a side may have vertices of their own.

    share : share of the sides inside the mesh that get vertices, for each of their two facets
    most : largest number of vertices that a facet gets on a side
    """
    vertices, triangles, zone = whole.vertices.tolist(), [], []
    facets = whole.triangles.tolist()
    shared = sides_of(whole.triangles)
    for number, corners in zip(whole.zone.tolist(), facets, strict=True):
        ring = []
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            ring.append(a)
            if shared[min(a, b), max(a, b)] == 2 and draw.uniform() < share:
                for part in np.sort(draw.uniform(0.1, 0.9, draw.integers(1, most + 1))):
                    ring.append(len(vertices))
                    vertices.append(((1.0 - part) * whole.vertices[a] + part * whole.vertices[b]).tolist())
        if len(ring) == 3:
            made = [ring]
        else:
            vertices.append(whole.vertices[corners].mean(axis=0).tolist())
            made = [[a, b, len(vertices) - 1] for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
        triangles += made
        zone += [number] * len(made)
    return replace(terrain_of(vertices, triangles, zone, whole.zones), frame=whole.frame)


def rounded(terrain: Terrain, decimals: int, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Terrain:
    """Return a terrain whose coordinates in a file have some decimals only, with equal vertices as one vertex.

    Facets that lose a corner are left out.

    origin : m, of the terrain in the file
    """
    written = np.round(terrain.vertices + np.array(origin), decimals)
    places, number = np.unique(written, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[terrain.triangles].astype(np.int32)
    a, b, c = triangles.T
    whole = (a != b) & (b != c) & (c != a)
    local = places - np.array(origin)
    return replace(terrain, vertices=local, triangles=triangles[whole], zone=terrain.zone[whole], frame=Frame(origin))


def sides_of(triangles: np.ndarray) -> Counter:
    """Return the number of facets at each side, by its two vertices (low, high); triangles : (F, 3)."""
    ends = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    return Counter(map(tuple, np.sort(ends, axis=1).tolist()))


def free_sides_inside(terrain: Terrain, outline: np.ndarray, margin: float = 0.05) -> int:
    """Return the number of sides with one facet that do not lie along the outline of the terrain.

    outline : low and high corner (2, 2) m of the terrain's rectangle in plan; margin : m
    """
    free = [side for side, uses in sides_of(terrain.triangles).items() if uses == 1]
    ends = terrain.vertices[np.array(free).reshape(-1, 2)][:, :, :2]
    along = [np.abs(ends - edge).max(axis=1) < margin for edge in outline]
    return int((~np.any(along, axis=(0, 2))).sum())


def directed_twice(terrain: Terrain) -> int:
    """Return the number of sides that two facets have in the same direction, so that the facets face different ways."""
    ends = np.concatenate([terrain.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    return sum(uses - 1 for uses in Counter(map(tuple, ends.tolist())).values() if uses > 1)


def areas_in_plan(terrain: Terrain) -> np.ndarray:
    """Return the signed areas (F,) m^2 of facets as seen from above; negative for a facet that faces down."""
    (ax, ay), (bx, by), (cx, cy) = (terrain.vertices[column, :2].T for column in terrain.triangles.T)
    return 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


def rough_ground(draw: Draw, size: float, cells: int = 5) -> Terrain:
    """Return rough ground that falls along x, on an irregular grid over a square with sides of `size` (m).

    Every second facet is in another zone.
    """
    ticks = np.linspace(0.0, size, cells + 1)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    inner = np.s_[1:-1, 1:-1]
    for plan in (x, y):
        plan[inner] += size / cells * draw.uniform(-0.3, 0.3, plan[inner].shape)
    z = -0.5 * x + 0.05 * size * draw.uniform(-1.0, 1.0, x.shape)
    triangles = grid_triangles(cells + 1, cells + 1)
    zone = (np.arange(len(triangles)) % 2).tolist()
    return terrain_of(np.stack([x, y, z], -1).reshape(-1, 3), triangles, zone, ("even", "odd"))
