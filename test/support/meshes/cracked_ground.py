"""Make meshes with T-junctions whose vertex lies slightly off the edge, and rocks that fly exactly to these cracks.

A rock that flies through such a crack at a crest may meet the back of the next facet, and fly on below the ground. A
crack is less than a nanometre wide, so no rock with a random start meets it.
"""

from collections import Counter

import numpy as np
from flights.scenes_of_facets import terrain_of

from meshes.cutting_pieces import highest
from rpf3d_core.terrain.facets import CRACK, Terrain, tolerance_of

Draw = np.random.Generator
GRAVITY = 9.81
FARTHEST = 4.0
"""Largest distance of a vertex from an edge, in crack widths, at which the vertex makes a T-junction with the edge.

The distance may exceed 1, because survey coordinates round the vertices after the cut.
"""


def cracked(draw: Draw, whole: Terrain) -> Terrain:
    """Return a terrain in which some facets are cut into two, at a new vertex near a shared edge.

    The neighbour across the edge is not cut, so the vertex is a T-junction, 0.01 to 0.8 crack widths off the edge.
    """
    vertices, triangles, cut = whole.vertices.tolist(), [], set()
    facets = whole.triangles.tolist()
    sides = Counter((min(pair), max(pair)) for t in facets for pair in zip(t, t[1:] + t[:1], strict=True))
    for t in facets:
        a, b, c = np.roll(t, draw.integers(3)).tolist()
        side = min(a, b), max(a, b)
        if sides[side] < 2 or side in cut or draw.uniform() < 0.5:
            triangles.append((a, b, c))
            continue
        cut.add(side)
        share = draw.choice([0.5, draw.uniform(0.1, 0.9)])
        off = draw.normal(size=3)
        off *= tolerance_of(whole) * CRACK * 10.0 ** draw.uniform(-2.0, -0.1) / np.linalg.norm(off)
        middle = (1.0 - share) * whole.vertices[a] + share * whole.vertices[b] + off
        triangles += [(a, len(vertices), c), (len(vertices), b, c)]
        vertices.append(middle.tolist())
    return terrain_of(vertices, triangles)


def junctions_of(terrain: Terrain) -> np.ndarray:
    """Return the T-junctions of a terrain as vertex numbers (J, 3): both ends of an edge, the vertex between them."""
    ends = np.concatenate([terrain.triangles[:, [0, 1]], terrain.triangles[:, [1, 2]], terrain.triangles[:, [2, 0]]])
    pairs, counts = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
    found, width = [], FARTHEST * CRACK * tolerance_of(terrain)
    for a, b in pairs[counts == 1].tolist():
        edge, to = terrain.vertices[b] - terrain.vertices[a], terrain.vertices - terrain.vertices[a]
        share = to @ edge / (edge @ edge)
        off = np.linalg.norm(to - share[:, None] * edge, axis=1)
        found += [(a, b, m) for m in np.flatnonzero((off < width) & (share > 1e-6) & (share < 1.0 - 1e-6)).tolist()]
    return np.array(found).reshape(-1, 3)


def releases_at_cracks(draw: Draw, terrain: Terrain, rocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (R, 3) m and velocities (R, 3) m/s of rocks that start in a crack or on an arc that leads there.

    A fifth of the rocks start in a crack, some of them at rest. A fifth move along the edge. All start on or above the
    ground. On a mesh without T-junctions, sides of facets take the place of cracks.
    """
    places, edges = _in_cracks(draw, terrain, rocks)
    random = draw.normal(size=(rocks, 3))
    random[:, 2] = -np.abs(random[:, 2])
    random = np.where(draw.uniform(size=(rocks, 1)) < 0.2, edges, random)
    hits = 10.0 ** draw.uniform(-1.0, 1.2, (rocks, 1)) * random / np.linalg.norm(random, axis=1)[:, None]
    t = 10.0 ** draw.uniform(-4.0, 0.3, (rocks, 1))
    fall, there = np.array([0.0, 0.0, GRAVITY]), draw.uniform(size=(rocks, 1)) < 0.2
    x = np.where(there, places, places - hits * t - 0.5 * t * t * fall)
    v = np.where(there, hits * (1.0, 1.0, 0.0), hits + t * fall)
    v = np.where(there & (draw.uniform(size=(rocks, 1)) < 0.3), 0.0, v)
    top = highest(terrain.vertices[terrain.triangles], x[:, :2])
    x = np.where(np.isfinite(top)[:, None], x, places)
    x[:, 2] = np.maximum(x[:, 2], highest(terrain.vertices[terrain.triangles], x[:, :2]))
    return x, v


def _in_cracks(draw: Draw, terrain: Terrain, rocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random places (R, 3) m in the cracks of T-junctions, and the long edges (R, 3) m of these T-junctions.

    A crack is the triangle between the long edge and the two short edges of a T-junction.
    """
    junctions = junctions_of(terrain)
    if not len(junctions):
        junctions = terrain.triangles[:, [0, 1, 0]]
    a, b, middle = terrain.vertices[junctions[draw.integers(0, len(junctions), rocks)]].transpose(1, 0, 2)
    edges, share = b - a, draw.uniform(size=(rocks, 1))
    at = ((middle - a) * edges).sum(1, keepdims=True) / (edges * edges).sum(1, keepdims=True)
    width = np.minimum(share / np.maximum(at, 1e-9), (1.0 - share) / (1.0 - at))
    return a + share * edges + draw.uniform(size=(rocks, 1)) * width * (middle - a - at * edges), edges
