"""Make random meshes with sharp gullies, or with many steep benches, and releases of rocks that are thrown at them.

Two errors of a simulation are likely on such meshes: rocks lose all speed in gullies sharper than 45 degrees; and rocks
that are released in the ground, vertically above an edge of an overhang, are not refused.
"""

import math
from collections.abc import Sequence

import numpy as np
from flights.scenes_of_facets import engine_over, terrain_of

from meshes.side_of_ground import has_odd_above
from rpf3d_core.ensemble.release_heights import ground_below_releases
from rpf3d_core.terrain.facets import Terrain

Draw = np.random.Generator
SIDE = 12.0
"""Length (m) of the meshes along their benches and gullies; their width is similar."""
GRAVITY = 9.81
NEAREST = 1e-8
"""Depth (m) below the ground up to which a thrown rock may start, as its coordinates are rounded."""


def strips(draw: Draw, rows: int, columns: int = 4) -> np.ndarray:
    """Return the triangles (F, 3) of a grid of `rows` by `columns` points; each cell is cut along either diagonal."""
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns
    other = (draw.uniform(size=len(a)) < draw.choice([0.0, 0.5, 1.0]))[:, None]
    first = np.where(other, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other, np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return np.concatenate([first, second]).astype(np.int32)


def wedges(draw: Draw) -> Terrain:
    """Return two to eight parallel gullies with opening angles of 5 to 100 degrees; half of the meshes are uneven."""
    x, profile = 0.0, [(0.0, 0.0)]
    for _ in range(int(draw.integers(2, 9))):
        opening, depth, rises = math.radians(draw.uniform(5.0, 100.0)), draw.uniform(0.3, 4.0), draw.uniform(0.3, 4.0)
        lean = draw.choice([0.5, draw.uniform()]) * opening
        down, up = (min(each, math.radians(85.0)) for each in (lean, opening - lean))
        x += depth * math.tan(max(down, 1e-2))
        profile.append((x, profile[-1][1] - depth))
        x += rises * math.tan(max(up, 1e-2))
        profile.append((x, profile[-1][1] + rises))
    return _extruded(draw, profile, 10.0 ** draw.uniform(-9.0, -1.0) * draw.integers(0, 2))


def terraces(draw: Draw) -> Terrain:
    """Return two to five benches whose faces are all inclined, all vertical or all overhanging.

    The mesh may be rotated in plan.
    """
    lean = draw.choice([0.0, draw.uniform(0.05, 1.5), -draw.uniform(0.05, 1.0), -draw.uniform(0.05, 1.0)])
    x, z, profile = 0.0, 0.0, []
    for _ in range(int(draw.integers(2, 6))):
        profile += [(x, z), (x + draw.uniform(2.5, 4.0), z - draw.uniform(0.0, 0.5))]
        x, z = profile[-1][0] + lean, profile[-1][1] - draw.uniform(1.0, 4.0)
    whole = _extruded(draw, [*profile, (x, z), (x + 4.0, z - 1.0)], draw.choice([0.0, 0.0, 0.1]))
    turn = draw.choice([0.0, draw.uniform(0.0, 2.0 * math.pi)])
    about = np.array([(math.cos(turn), math.sin(turn), 0), (-math.sin(turn), math.cos(turn), 0), (0, 0, 1)])
    return terrain_of(whole.vertices @ about, whole.triangles)


def _extruded(draw: Draw, profile: Sequence[tuple[float, float]], noise: float) -> Terrain:
    """Return a profile of points (x, z) m, extruded along y in strips that may slope along y.

    noise : largest random change (m) of the heights of vertices
    """
    rows, along = np.linspace(0.0, SIDE, int(draw.integers(2, 9))), draw.choice([0.0, draw.uniform(-1.0, 1.0)])
    corners = np.array([(x, y, z + along * y) for y in rows for x, z in profile])
    corners[:, 2] += noise * draw.uniform(-1.0, 1.0, len(corners))
    return terrain_of(corners, strips(draw, len(rows), len(profile)))


def releases_thrown(draw: Draw, terrain: Terrain, rocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (R, 3) m and velocities (R, 3) m/s of rocks on facets, or on arcs that lead to facets.

    Half of the rocks start on a vertex, an edge or a facet, at rest or with a velocity along the facet. The other half
    start on an arc that leads to such a place; the arc may pass through other ground. A rock that would start in the
    ground starts at rest on the facet instead. The simulator's own search for such rocks misses those that are a few um
    deep in the corner under an overhang, so all facets are searched as well.
    """
    corners = terrain.vertices[terrain.triangles[draw.integers(0, len(terrain.triangles), rocks)]]
    share = draw.dirichlet([1.0, 1.0, 1.0], rocks)
    kind = draw.choice(3, rocks, p=[0.3, 0.3, 0.4])
    share[kind == 1, 2] = 0.0
    share[kind == 0] = (1.0, 0.0, 0.0)
    place = (corners * (share / share.sum(1)[:, None])[:, :, None]).sum(1)
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    fast = 10.0 ** draw.uniform(-2.0, 1.0, (rocks, 1))
    random = draw.normal(size=(rocks, 3))
    random[draw.uniform(size=rocks) < 0.4] = (0.0, 0.0, -1.0)  # straight down: down the facet, or a drop
    pushed = draw.uniform(size=(rocks, 1)) < 0.6
    v = np.where(pushed, fast * (random - (random * n).sum(1)[:, None] * n), 0.0)
    thrown = draw.uniform(size=rocks) < 0.5
    hits = fast * np.where((random * n).sum(1)[:, None] > 0.0, -random, random)
    t = 10.0 ** draw.uniform(-3.0, 0.3, (rocks, 1))
    fall = np.array([0.0, 0.0, GRAVITY])
    x = np.where(thrown[:, None], place - hits * t - 0.5 * t * t * fall, place)
    v = np.where(thrown[:, None], hits + t * fall, v)
    found = ground_below_releases(engine_over("compiled", terrain), x)
    inside = has_odd_above(terrain.vertices[terrain.triangles], x, NEAREST)
    refused = ((found[:, 1] < 0.0) | (found[:, 2] < 0.0) | inside) & thrown
    return np.where(refused[:, None], place, x), np.where(refused[:, None], 0.0, v)
