"""Make the mesh of a synthetic pit: join the columns of points by triangles, and give each triangle a zone."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.pit.columns import Columns, Spacing
from rpf3d_core.terrain.pit.design import Design
from rpf3d_core.terrain.pit.relief import SMOOTH_SHARE, hills, pile_spills, roughness, steepness
from rpf3d_core.terrain.pit.strips import StripLines, strip_triangles

IndexArray = NDArray[np.int64]
STEEP_SHARE = 0.5
"""Least slope of a profile segment in zone `face`, over the slope of the bench faces (-).

Other segments count as level.
"""
ROUNDING = 1.0e-9
"""Precision to which bench levels are compared, as a share of a bench height (-)."""
FEWEST_ROUND = 6
"""Least number of points in a ring of the floor's mesh, except the single point in the middle."""


def surface_of(design: Design, columns: Columns, spacing: Spacing) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the mesh of a pit: vertices (V, 3) m, z = 0 at the crest, triangles (F, 3) and zones (F,).

    Zones are indices into `design.zones`. A triangle with at least two corners on spills is in zone `spill`.
    """
    points, spilled = wall_vertices(design, columns)
    triangles, zone = wall_triangles(design, columns)
    zone[spilled[triangles].sum(axis=1) >= 2] = design.zones.index("spill")
    middle, rings = floor_rings(design, columns, spacing)
    points = np.concatenate([points, middle])
    points[:, 2] -= design.pit.levels[-1]
    zone = np.concatenate([zone, np.full(len(rings), design.zones.index("floor"))])
    return points, np.concatenate([triangles, rings]).astype(np.int32), zone.astype(np.int32)


def wall_vertices(design: Design, columns: Columns) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the points (P, 3) m of the columns with all relief, z above the floor, and flags (P,): true on spills."""
    x, y = design.plan(columns.column / columns.around, columns.offset)
    points = np.stack([x, y, columns.height], axis=1)
    spilled = pile_spills(design, columns, points)
    points[:, 2] += hills(design, columns, points) + steepness(design, columns) * roughness(design, points)
    return points, spilled


def wall_triangles(design: Design, columns: Columns) -> tuple[IndexArray, IndexArray]:
    """Return triangles (T, 3) that join neighbouring columns of points, and the zones (T,) of the triangles."""
    every, ahead = np.arange(len(columns.column)), columns.column
    turned = np.roll(every, -int(np.searchsorted(columns.column, 1)))
    behind = (columns.column[turned] - 1) % columns.around
    right = StripLines(strip=ahead, key=columns.key_ahead, point=every)
    left = StripLines(strip=behind, key=columns.key_behind[turned], point=turned)
    triangles, entry = strip_triangles(right, left)
    zone_ahead, zone_behind = piece_zones(design, columns)
    return triangles, np.concatenate([zone_ahead, zone_behind[turned]])[entry]


def piece_zones(design: Design, columns: Columns) -> tuple[IndexArray, IndexArray]:
    """Return the zone of the profile segment that ends at each point, as two arrays (P,).

    Zones are indices into `design.zones`. The first array is for the triangles between a column and the
    next column, the second for the triangles between a column and the previous column. The arrays differ only at the
    ends of the ramp: natural ground follows the last line across the ramp, and the floor precedes the first line.
    """
    rise, run = np.diff(columns.height, prepend=0.0), np.diff(columns.offset, prepend=0.0)
    lower = design.bench_coordinate(columns.height - np.maximum(rise, 0.0))
    flat = np.array([flat_zone(design, level) for level in range(len(design.pit.levels))])
    zone = flat[np.floor(lower + ROUNDING).astype(np.int64)]
    zone[rise * design.cot > STEEP_SHARE * run] = design.zones.index("face")
    on_ramp = (columns.ramp >= 0) & (np.roll(columns.ramp, 1) == columns.ramp)
    zone[on_ramp] = design.zones.index("ramp")
    ahead, behind = zone.copy(), zone.copy()
    ahead[on_ramp & columns.at_top] = design.zones.index("ground")
    behind[on_ramp & columns.at_foot] = design.zones.index("floor")
    return ahead, behind


def flat_zone(design: Design, level: int) -> int:
    """Return the zone of level ground (floor, bench or natural ground) at a level counted from the floor (0)."""
    top = len(design.pit.levels) - 1
    if level in (0, top):
        return design.zones.index("floor" if level == 0 else "ground")
    return design.zones.index(f"bench_{top - level}" if design.benches else "face")


def floor_ring_sizes(design: Design, spacing: Spacing, columns: int) -> list[int]:
    """Return the number of points of each ring that fills the middle of the floor, from the outermost ring inwards.

    spacing : distances between points; columns : largest number of points of a ring
    """
    reach = design.pit.floor_radius + design.inner
    steps = max(1, round(reach / spacing.edge))
    around = 2.0 * np.pi * reach / spacing.edge
    return [*(min(columns, max(FEWEST_ROUND, round(around * step / steps))) for step in range(steps - 1, 0, -1)), 1]


def floor_rings(design: Design, columns: Columns, spacing: Spacing) -> tuple[FloatArray, IndexArray]:
    """Return the points (N, 3) m and triangles (T, 3) that fill the middle of the floor, inside the mesh of the walls.

    The points form rings around the middle; inner rings have fewer points. The points are numbered after the points of
    the columns.
    """
    ring = np.searchsorted(columns.column, np.arange(columns.around))
    p = np.arange(columns.around) / columns.around
    sizes, used = floor_ring_sizes(design, spacing, columns.around), len(columns.column)
    vertices, triangles = [], []
    for step, size in enumerate(sizes, start=1):
        inner_p, inner = np.arange(size) / size, np.arange(used, used + size)
        vertices.append(ring_points(design, inner_p, 1.0 - step / len(sizes)))
        triangles.append(ring_triangles(ring, p, inner, inner_p))
        ring, p, used = inner, inner_p, used + size
    points = np.concatenate(vertices)
    points[:, 2] += SMOOTH_SHARE * roughness(design, points)
    return points, np.concatenate(triangles)


def ring_points(design: Design, p: FloatArray, share: float) -> FloatArray:
    """Return the points (P, 3) m of a level ring of the floor, at height 0.

    The ring is the innermost line of the wall's mesh, scaled by `share` about the middle of the pit.

    p : (P,) position around the pit, as a fraction of one full turn
    """
    x, y = design.plan(p, np.full(len(p), design.inner))
    return np.stack([share * x, share * y, np.zeros(len(p))], axis=1)


def ring_triangles(outer: IndexArray, outer_key: FloatArray, inner: IndexArray, inner_key: FloatArray) -> IndexArray:
    """Return the triangles (T, 3) between two rings of the floor; an inner ring of one point closes the floor.

    outer, inner : (P,), (Q,) numbers of the points of each ring
    outer_key, inner_key : (P,), (Q,) position of each point around the pit, as a fraction of a turn (-)
    """
    right = StripLines(
        strip=np.zeros(len(outer) + 1, dtype=np.int64), key=np.append(outer_key, 1.0), point=np.append(outer, outer[0])
    )
    if len(inner) > 1:
        inner_key, inner = np.append(inner_key, 1.0), np.append(inner, inner[0])
    return strip_triangles(right, StripLines(strip=np.zeros(len(inner), dtype=np.int64), key=inner_key, point=inner))[0]
