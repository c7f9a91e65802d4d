"""The stretch of an arc over one bucket, with fast tests that exclude facets before the exact contact test.

Contacts before and after the stretch belong to other buckets and do not count. A facet is excluded only if the stretch
misses it by REACH tolerances, which is far more than rounding and the slack of a contact.
"""

from typing import NamedTuple

from rpf3d_core.arc import Arc, position
from rpf3d_core.detection.bucket_grid import Grid
from rpf3d_core.detection.plan_boxes import packed_probe, part_of
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import REACH, corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, subtract

SLOWEST = 1e-100
"""Speed in plan (m/s) below which an arc counts as vertical: with lower speeds, floats could overflow or underflow."""


class Stretch(NamedTuple):
    """The part of an arc between two times, over one bucket: from p to q (m), at most `bend` (m) above its chord.

    v : (3,) m/s at the start of the arc; its direction in plan is more exact than the direction of a short q - p
    probe : box of the stretch in plan, to compare with the boxes of a bucket's facets (`plan_boxes.overlap`)
    """

    p: Vec
    q: Vec
    v: Vec
    bend: float
    probe: int


@kernel
def stretch_of(grid: Grid, i: int, j: int, arc: Arc, begin: float, end: float) -> Stretch:
    """Return the stretch of an arc from time `begin` to time `end` (s), over the cell in column i and row j."""
    p, q, lasts = position(arc, begin), position(arc, end), end - begin
    return Stretch(p=p, q=q, v=arc.v, bend=0.125 * arc.gravity * lasts * lasts, probe=probe_of(grid, i, j, p, q))


@kernel
def probe_of(grid: Grid, i: int, j: int, p: Vec, q: Vec) -> int:
    """Return the box in plan between points p and q (m), packed for the comparison with the boxes of a bucket's facets.

    i, j : column and row of the bucket
    """
    per_cell = 1.0 / grid.cell
    return packed_probe(
        part_of(min(p[0], q[0]), grid.x, per_cell, i), part_of(max(p[0], q[0]), grid.x, per_cell, i),
        part_of(min(p[1], q[1]), grid.y, per_cell, j), part_of(max(p[1], q[1]), grid.y, per_cell, j),
    )  # fmt: skip


@kernel
def out_of_reach(facets: Facets, f: int, stretch: Stretch) -> bool:
    """Return True if a stretch of an arc cannot touch facet f, so that the exact contact test is not needed.

    Either facet f lies on one side of the stretch's line in plan, or the stretch stays on one side of the plane of
    facet f. The slack is REACH tolerances.
    """
    slack = REACH * facets.tolerance
    return _beside(facets, f, stretch, slack) or _on_one_side(facets, f, stretch, slack)


@kernel
def _beside(facets: Facets, f: int, stretch: Stretch, slack: float) -> bool:
    """Return True if facet f lies on one side of the stretch's line in plan, by more than the slack (m).

    The result is False for a vertical stretch, whose line in plan is a point.
    """
    p, v = stretch.p, stretch.v
    a = left_of(v, p, corner(facets, f, 0))
    b = left_of(v, p, corner(facets, f, 1))
    c = left_of(v, p, corner(facets, f, 2))
    speed = abs(v[0]) + abs(v[1])
    return speed > SLOWEST and (max(a, b, c) < -slack * speed or min(a, b, c) > slack * speed)


@kernel
def left_of(v: Vec, p: Vec, corner: Vec) -> float:
    """Return the distance of a corner to the left of a line in plan, times the speed along the line (m^2/s).

    The result is below 0 for a corner to the right of the line. All vectors are used in plan only.

    p, v : (3,) m and m/s, a point of the line and the velocity along the line; corner : (3,) m
    """
    return v[0] * (corner[1] - p[1]) - v[1] * (corner[0] - p[0])


@kernel
def _on_one_side(facets: Facets, f: int, stretch: Stretch, slack: float) -> bool:
    """Return True if the whole stretch stays on one side of the plane of facet f, by more than the slack (m)."""
    n, origin = stored_normal(facets, f), corner(facets, f, 0)
    begin, end = dot(n, subtract(stretch.p, origin)), dot(n, subtract(stretch.q, origin))
    bend = n[2] * stretch.bend
    return bool(min(begin, end) + min(bend, 0.0) > slack or max(begin, end) + max(bend, 0.0) < -slack)
