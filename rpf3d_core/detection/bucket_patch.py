"""Update the buckets and slabs of a terrain in place when a new survey (a patch) replaces some facets.

An entry is one facet in one bucket. The entries in the rows of cells that the patch touches are written again, all
later entries are moved, and the other entries stay in place. The slabs of all levels over the patch are computed again.
Searches give the same results as if all facets had been sorted again; only the order within a bucket differs, and
nothing depends on this order.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_grid import BAND, ENTRIES_PER_FACET, CellRectangle, Grid, box_over, cells_under, common
from rpf3d_core.detection.bucket_locator import BucketLocator, grid_of
from rpf3d_core.detection.slabs import (
    LEVELS,
    SHIFT,
    SlabTable,
    add_normal,
    clear_block,
    lean_upwards,
    raise_over,
    slab_row,
    slab_table,
)
from rpf3d_core.errors import TerrainError
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.memory import Kept, Share
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.terrain.frame import FloatArray

Plan = tuple[float, float]
"""A point in plan: x, y (m)."""


class Entries(NamedTuple):
    """For each cell of a rectangle, the new facets of a patch (S in total) that the cell contains.

    The facets in cell k are ids[starts[k] : starts[k + 1]]; the cells are counted row by row (`cell_in`).

    starts : (cells + 1,); ids : (E,) for all E entries, number of the facet within the patch, 0 to S - 1
    """

    starts: NDArray[np.int64]
    ids: NDArray[np.int32]


class BucketPatch(NamedTuple):
    """The facets that a patch removes from the buckets, and the S facets that it adds.

    gone : (F,) True for facets to remove, by their numbers before the patch
    rows : (S,) number of each new facet in the patched terrain
    block : rectangle of cells around all facets that are removed or added; entries : the new facets in these cells
    """

    gone: NDArray[np.bool_] | NDArray[np.uint8]
    rows: NDArray[np.int32]
    block: CellRectangle
    entries: Entries


def block_of(corners: FloatArray, locator: BucketLocator, slack: float) -> CellRectangle:
    """Return the rectangle of cells around some facets, so that an update changes only these cells.

    corners : (S, 9) m (3 corners each), of these facets; slack : m, by which the box of each facet is widened
    """
    sides = np.empty(4, np.int64)
    _block(corners, slack, grid_of(locator), sides)
    left, right, bottom, top = sides.tolist()
    return CellRectangle(left=left, right=right, bottom=bottom, top=top)


def facets_in(locator: BucketLocator, block: CellRectangle) -> NDArray[np.int64]:
    """Return the numbers of the facets (N,) in a rectangle of cells, each facet once, in ascending order."""
    rows = (row * locator.nx for row in range(block.bottom, block.top))
    parts = [locator.ids[locator.starts[row + block.left] : locator.starts[row + block.right]] for row in rows]
    ids = np.sort(np.concatenate(parts)) if parts else np.empty(0, np.int32)
    first = np.ones(len(ids), dtype=bool)
    first[1:] = ids[1:] != ids[:-1]
    return ids[first].astype(np.int64)


def entries_of(corners: FloatArray, locator: BucketLocator, block: CellRectangle, slack: float, most: int) -> Entries:
    """Return the new facets of a patch, listed by the cells of a rectangle.

    corners : (S, 9) m (3 corners each), of the new facets; slack : m, by which the box of each facet is widened
    most : largest allowed number of entries; more raise a TerrainError
    """
    starts = np.zeros((block.right - block.left) * (block.top - block.bottom) + 1, np.int64)
    if not _count_some(corners, slack, grid_of(locator), block, most, starts):
        raise TerrainError("the facets of the patch are far wider than those of the ground; publish the whole terrain")
    np.cumsum(starts, out=starts)
    ids = np.empty(int(starts[-1]), np.int32)
    _fill_some(corners, slack, grid_of(locator), block, starts[:-1].copy(), ids)
    return Entries(starts, ids)


def patched_locator(
    locator: BucketLocator, facets: Facets, patch: BucketPatch, memory: Kept, share: Share
) -> BucketLocator:
    """Return the locator of a terrain after a patch; its arrays are changed in place: do not use `locator` afterwards.

    facets : the facets after the patch; memory : provides the arrays of the locator, which may get longer
    share : runs functions in parallel
    """
    block = patch.block
    band = slice(block.bottom * locator.nx, block.top * locator.nx + 1)
    before = locator.starts[band]
    counts = np.zeros(len(before), np.int64)
    _count_kept(locator, patch, counts)
    np.cumsum(counts, out=counts)
    counts += before[0]
    ids, boxes = np.empty(counts[-1] - before[0], np.int32), np.empty(counts[-1] - before[0], np.uint32)
    _lay_band(locator, facets.corners, REACH * facets.tolerance, patch, ids, boxes)
    total, begin, tail, shift = len(locator.ids), int(before[0]), int(before[-1]), int(counts[-1] - before[-1])
    all_ids, all_boxes = (memory.longer(name, max(total, total + shift)) for name in ("ids", "boxes"))
    share([
        lambda: _move(all_ids, tail, total, shift), lambda: _move(all_boxes, tail, total, shift),
        lambda: _add_to(locator.starts, band.stop - 1, shift),
    ])  # fmt: skip
    all_ids[begin : begin + len(ids)], all_boxes[begin : begin + len(ids)] = ids, boxes
    locator.starts[band] = counts
    edited = locator._replace(ids=all_ids[: total + shift], boxes=all_boxes[: total + shift])
    _over_block(edited, facets, _whole_cells(block, locator), share)
    return edited


def _move(array: NDArray[Any], begin: int, end: int, shift: int) -> None:
    """Move the elements `begin` to `end` - 1 of an array by `shift` places, because a patch changes their number."""
    if shift:
        array[begin + shift : end + shift] = array[begin:end]


def most_entries(facets: int) -> int:
    """Return the largest allowed number of entries of a terrain with `facets` facets, which a patch must not exceed.

    An entry is one facet in one bucket.
    """
    return ENTRIES_PER_FACET * facets


def _whole_cells(block: CellRectangle, locator: BucketLocator) -> CellRectangle:
    """Return a rectangle of buckets, widened to whole cells of the largest size, in which slabs are computed again."""
    low, high = (block.left, block.bottom), (block.right, block.top)
    (left, bottom), (right, top) = (
        tuple(k // BAND * BAND for k in low), tuple(-(-k // BAND) * BAND for k in high),
    )  # fmt: skip
    return CellRectangle(left=left, right=min(right, locator.nx), bottom=bottom, top=min(top, locator.ny))


def _over_block(locator: BucketLocator, facets: Facets, block: CellRectangle, share: Share) -> None:
    """Compute the slabs over a rectangle of buckets again, in parallel: one task per column of the widest cells."""
    table, slack = slab_table(locator.slabs, locator.nx), REACH * facets.tolerance
    some = [block._replace(left=a, right=min(a + BAND, block.right)) for a in range(block.left, block.right, BAND)]
    share([
        lambda part=part: _renew_slabs(facets.corners, facets.normals, slack, locator, part, table)  # type: ignore[misc]
        for part in some
    ])  # fmt: skip


@kernel
def cell_in(block: CellRectangle, i: int, j: int) -> int:
    """Return the number of a cell, counted row by row within a rectangle, from its column i and row j in the grid."""
    return (j - block.bottom) * (block.right - block.left) + i - block.left


@loop
def _block(corners: Any, slack: float, grid: Grid, sides: Any) -> None:
    """Write left, right, bottom and top of the rectangle of cells around some facets into `sides`.

    corners : (S, 9) m (3 corners each), of the facets; slack : m by which each facet is widened; sides : (4,), changed
    """
    sides[0], sides[1], sides[2], sides[3] = grid.nx, 0, grid.ny, 0
    for f in range(corners.shape[0]):
        cells = cells_under(corners, f, slack, grid)
        sides[0], sides[1] = min(sides[0], cells.left), max(sides[1], cells.right)
        sides[2], sides[3] = min(sides[2], cells.bottom), max(sides[3], cells.top)


@loop
def _count_some(corners: Any, slack: float, grid: Grid, block: CellRectangle, most: int, starts: Any) -> bool:
    """Add the number of new facets in each cell k of a rectangle to starts[k + 1]; return False if there are too many.

    The function stops and returns False as soon as the facets have more than `most` entries; otherwise it returns True.
    An entry is one facet in one cell of the whole grid.

    corners : (S, 9) m (3 corners each), of the new facets; slack : m by which each facet is widened
    block : the rectangle of cells; starts : (cells + 1,), changed
    """
    entries = 0
    for f in range(corners.shape[0]):
        cells = cells_under(corners, f, slack, grid)
        entries += (cells.right - cells.left) * (cells.top - cells.bottom)
        if entries > most:
            return False
        cells = common(cells, block)
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                starts[cell_in(block, i, j) + 1] += 1
    return True


@loop
def _fill_some(corners: Any, slack: float, grid: Grid, block: CellRectangle, cursor: Any, ids: Any) -> None:
    """Write the new facets in each cell of a rectangle into `ids`.

    cursor : (cells,) for each cell, the index in `ids` of its next facet; changed
    corners : (S, 9) m (3 corners each), of the new facets; slack : m by which each facet is widened
    block : the rectangle of cells
    """
    for f in range(corners.shape[0]):
        cells = common(cells_under(corners, f, slack, grid), block)
        for j in range(cells.bottom, cells.top):
            for i in range(cells.left, cells.right):
                k = cell_in(block, i, j)
                ids[cursor[k]] = f
                cursor[k] += 1


@loop
def _count_kept(locator: BucketLocator, patch: BucketPatch, counts: Any) -> None:
    """Count the facets that each bucket in the rows of a patch will have after the patch.

    counts : at index n + 1, receives the count of bucket n, counted from the first bucket of these rows
    """
    block, come = patch.block, patch.entries.starts
    for j in range(block.bottom, block.top):
        for i in range(locator.nx):
            k, stay = j * locator.nx + i, 0
            if block.left <= i < block.right:
                for entry in range(locator.starts[k], locator.starts[k + 1]):
                    stay += 0 if patch.gone[locator.ids[entry]] else 1
                c = cell_in(block, i, j)
                stay += come[c + 1] - come[c]
            else:
                stay = locator.starts[k + 1] - locator.starts[k]
            counts[k - block.bottom * locator.nx + 1] = stay


@loop
def _lay_band(
    locator: BucketLocator, corners: Any, slack: float, patch: BucketPatch, new_ids: Any, new_boxes: Any
) -> None:
    """Write the facets of all buckets in the rows of a patch: first the facets that stay, then the new facets.

    corners : (F, 9) m (3 corners each), of all facets after the patch
    slack : m, by which the box of each facet is widened
    new_ids, new_boxes : receive the facets and their boxes, as in `Buckets`
    """
    at, block, come = 0, patch.block, patch.entries
    for j in range(block.bottom, block.top):
        for i in range(locator.nx):
            k = j * locator.nx + i
            inside = block.left <= i < block.right
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                if not (inside and patch.gone[locator.ids[entry]]):
                    new_ids[at], new_boxes[at] = locator.ids[entry], locator.boxes[entry]
                    at += 1
            if inside:
                c = cell_in(block, i, j)
                for entry in range(come.starts[c], come.starts[c + 1]):
                    f = patch.rows[come.ids[entry]]
                    new_ids[at], new_boxes[at] = f, box_over(corners, f, slack, grid_of(locator), i, j)
                    at += 1


@loop
def _add_to(array: Any, begin: int, amount: int) -> None:
    """Add an amount to all elements of an array from `begin` on, to move the starts of the buckets after a patch."""
    for k in range(begin, len(array)):
        array[k] += amount


@loop
def _renew_slabs(
    corners: Any, normals: Any, slack: float, locator: BucketLocator, block: CellRectangle, table: SlabTable
) -> None:
    """Compute the slabs over a rectangle of whole cells again, from the facets in its buckets.

    corners, normals : (F, 9) m (3 corners each) and (F, 3), of all facets; slack : m by which each facet is widened
    block : the rectangle of cells; table : receives the slabs
    """
    clear_block(table, block)
    for j in range(block.bottom, block.top):
        for i in range(block.left, block.right):
            k = j * locator.nx + i
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                add_normal(normals, locator.ids[entry], table.planes, k)
    lean_upwards(table, block)
    for j in range(block.bottom, block.top):
        for i in range(block.left, block.right):
            k = j * locator.nx + i
            for entry in range(locator.starts[k], locator.starts[k + 1]):
                _raise_levels(corners, locator.ids[entry], slack, grid_of(locator), i, j, table)


@kernel
def _raise_levels(corners: Any, f: int, slack: float, grid: Grid, i: int, j: int, table: SlabTable) -> None:
    """Raise the slab of bucket (i, j), and of the wider cells with this bucket, so that facet f lies below them.

    The slab of a wider cell is raised only if this bucket is the first bucket of facet f in the wider cell.

    corners : (F, 9) m (3 corners each), of all facets; slack : m, by which the facet is widened
    grid : of the buckets; i, j : column and row of the bucket; table : the slabs, changed
    """
    raise_over(corners, f, table.planes, slab_row(table, 0, i, j))
    cells = cells_under(corners, f, slack, grid)
    for level in range(1, LEVELS):
        shift = SHIFT * level
        if i == max(cells.left, (i >> shift) << shift) and j == max(cells.bottom, (j >> shift) << shift):
            raise_over(corners, f, table.planes, slab_row(table, level, i >> shift, j >> shift))
