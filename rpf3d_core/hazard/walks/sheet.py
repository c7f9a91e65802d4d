"""Find the neighbours of facets where no facet lies above another (a sheet), so that paths need no search there.

Over a sheet, a track is followed from facet to facet without searching buckets. Rocks reach few of a mine's millions of
facets, so the neighbours of a facet are computed when they are first needed, and then kept. Several threads may compute
the same neighbours at the same time: they write the same numbers.

A bucket is clear if no border or fold of the terrain runs through it and exactly one facet lies over one tested place
of the bucket. In plan the number of facets over a place changes only at borders and folds, so every place of the bucket
has one facet.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.detection.bucket_grid import CellRectangle, cell_index
from rpf3d_core.detection.bucket_locator import BucketLocator, grid_of
from rpf3d_core.detection.bucket_patch import block_of, facets_in
from rpf3d_core.detection.plan_boxes import overlap
from rpf3d_core.detection.stretch import probe_of
from rpf3d_core.hazard.walks.over_facet import VERTICAL
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.jit.memory import longer
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec

UNKNOWN, YES, NO = 0, 1, 2
"""Values in the arrays `alone` and `clear` of a `Sheet`; UNKNOWN also in `beyond`."""
NOTHING = -1
"""Value for a side that has no neighbour, several neighbours, or a neighbour with opposite winding."""
CROWDED = 64
"""Largest number of facets in a bucket (search square) that is tested; a bucket with more facets counts as not clear.

The test compares the facets of a bucket in pairs: millions of pairs if buckets made for a coarse mesh contain a fine
mesh.
"""
MIDDLE = (0.5137, 0.5071)
"""Place in a bucket that is tested, in shares of its sides (-): not the exact middle, where edges often lie."""


class Sheet(NamedTuple):
    """What is known about the neighbours of F facets and about B buckets (search squares); at first UNKNOWN.

    beyond : (3 F,) entry 3 f + k is for side k of facet f, which starts at corner k: 1 + 4 g + m if this side
        has only one neighbour, side m of facet g; else NOTHING
    clear : (B,) YES if exactly one facet lies over each place of a bucket; alone : (F,) YES if all buckets under a
        facet are clear
    """

    beyond: Any
    alone: Any
    clear: Any


def unknown_sheet(facets: Facets, locator: BucketLocator) -> Sheet:
    """Return a `Sheet` of facets and buckets in which every value is still UNKNOWN."""
    count = len(facets.zone)
    return Sheet(
        beyond=np.zeros(3 * count, dtype=np.int32),
        alone=np.zeros(count, dtype=np.int8),
        clear=np.zeros(locator.nx * locator.ny, dtype=np.int8),
    )


def sheet_after(sheet: Sheet, facets: Facets, locator: BucketLocator, changed: CellRectangle) -> Sheet:
    """Return the sheet after some facets have changed: every value that may differ becomes UNKNOWN.

    The result reuses the memory of `sheet`. All old and new places of changed facets are in the buckets `changed`. A
    facet with a new neighbour shares a changed bucket with this neighbour. So values become UNKNOWN for all facets in
    the changed buckets, for every bucket that these facets reach, and for all facets in the reached buckets.
    """
    reached = block_of(facets.corners[facets_in(locator, changed)], locator, 0.0)
    near, count = facets_in(locator, reached), len(facets.zone)
    beyond, alone = longer(sheet.beyond, 3 * count, UNKNOWN), longer(sheet.alone, count, UNKNOWN)
    beyond[(3 * near[:, None] + np.arange(3)).ravel()] = UNKNOWN
    alone[near] = UNKNOWN
    rows, columns = slice(reached.bottom, reached.top), slice(reached.left, reached.right)
    sheet.clear.reshape(locator.ny, locator.nx)[rows, columns] = UNKNOWN
    return Sheet(beyond=beyond, alone=alone, clear=sheet.clear)


@kernel
def facet_beyond(sheet: Sheet, locator: BucketLocator, facets: Facets, f: int, k: int) -> tuple[int, int]:
    """Return the neighbour of facet f at side k, and the number (0 to 2) of the shared side in the neighbour.

    Returns (NOTHING, 0) unless exactly one facet shares the side, with the same winding.
    """
    known = sheet.beyond[3 * f + k]
    if known == UNKNOWN:
        known = _found_beyond(locator, facets, f, k)
        sheet.beyond[3 * f + k] = known
    if known < 0:
        return NOTHING, 0
    return (known - 1) >> 2, (known - 1) & 3


@kernel
def is_alone(sheet: Sheet, locator: BucketLocator, facets: Facets, f: int) -> bool:
    """Return True if no other facet lies above or below any part of facet f: a path needs no search there.

    The result is False if this is not certain.
    """
    if sheet.alone[f] == UNKNOWN:
        sheet.alone[f] = YES if _lies_in_clear_buckets(sheet, locator, facets, f) else NO
    return bool(sheet.alone[f] == YES)


@kernel
def _lies_in_clear_buckets(sheet: Sheet, locator: BucketLocator, facets: Facets, f: int) -> bool:
    """Return True if exactly one facet lies over each place of all buckets under the box of facet f."""
    a, b, c = corner(facets, f, 0), corner(facets, f, 1), corner(facets, f, 2)
    i0 = cell_index(min(a[0], b[0], c[0]), locator.x, locator.cell, locator.nx)
    i1 = cell_index(max(a[0], b[0], c[0]), locator.x, locator.cell, locator.nx)
    j0 = cell_index(min(a[1], b[1], c[1]), locator.y, locator.cell, locator.ny)
    j1 = cell_index(max(a[1], b[1], c[1]), locator.y, locator.cell, locator.ny)
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            bucket = j * locator.nx + i
            if sheet.clear[bucket] == UNKNOWN:
                sheet.clear[bucket] = YES if _is_clear(sheet, locator, facets, i, j) else NO
            if sheet.clear[bucket] == NO:
                return False
    return True


@kernel
def _is_clear(sheet: Sheet, locator: BucketLocator, facets: Facets, i: int, j: int) -> bool:
    """Return True if the bucket in column i and row j is clear: exactly one facet lies over each place of the bucket.

    The result is False if this is not certain, for example for a bucket with more than CROWDED (64) facets.
    """
    bucket = j * locator.nx + i
    x, y = locator.x + (i + MIDDLE[0]) * locator.cell, locator.y + (j + MIDDLE[1]) * locator.cell
    over, near = 0, 0
    if locator.starts[bucket + 1] - locator.starts[bucket] > CROWDED:
        return False
    for entry in range(locator.starts[bucket], locator.starts[bucket + 1]):
        f: Any = np.int64(locator.ids[np.uintp(entry)])
        if stored_normal(facets, f)[2] <= VERTICAL:
            return False
        for k in range(3):
            if facet_beyond(sheet, locator, facets, f, k)[0] == NOTHING:
                return False
        inside = _least_inside(facets, f, x, y)
        over += 1 if inside > facets.tolerance else 0
        near += 1 if inside >= -facets.tolerance else 0
    return over == 1 and near == 1


@kernel
def _least_inside(facets: Facets, f: int, x: float, y: float) -> float:
    """Return roughly the distance (m) in plan from a place x, y (m) to the nearest side of facet f.

    The result is negative if the place is outside the facet. The distance is measured along the x or y axis, which is
    faster, so the result is 1 to 1.42 times the true distance from the line of the side.
    """
    least = np.inf
    for k in range(3):
        a, b = corner(facets, f, k), corner(facets, f, (k + 1) % 3)
        ex, ey = b[0] - a[0], b[1] - a[1]
        least = min(least, (ex * (y - a[1]) - ey * (x - a[0])) / max(abs(ex), abs(ey)))
    return least


@kernel
def _found_beyond(locator: BucketLocator, facets: Facets, f: int, k: int) -> int:
    """Return the neighbour at side k of facet f, as an entry of `Sheet.beyond`.

    All facets that share the side are in the bucket of the side's first corner.
    """
    a, b = corner(facets, f, k), corner(facets, f, (k + 1) % 3)
    i = cell_index(a[0], locator.x, locator.cell, locator.nx)
    j = cell_index(a[1], locator.y, locator.cell, locator.ny)
    bucket, found, others = j * locator.nx + i, NOTHING, 0
    corner_only = probe_of(grid_of(locator), i, j, a, a)
    for entry in range(locator.starts[bucket], locator.starts[bucket + 1]):
        if not overlap(locator.boxes[np.uintp(entry)], corner_only):
            continue
        g: Any = np.int64(locator.ids[np.uintp(entry)])
        if g == f:
            continue
        for m in range(3):
            if _same(corner(facets, g, m), b) and _same(corner(facets, g, (m + 1) % 3), a):
                found, others = 1 + 4 * g + m, others + 1
            elif _same(corner(facets, g, m), a) and _same(corner(facets, g, (m + 1) % 3), b):
                others += 2
    return found if others == 1 else NOTHING


@kernel
def _same(p: Vec, q: Vec) -> bool:
    """Return True if two points have exactly the same coordinates."""
    return p[0] == q[0] and p[1] == q[1] and p[2] == q[2]
