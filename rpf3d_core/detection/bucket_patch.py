"""Update of buckets and slabs in place where a patch replaces facets; all other entries stay.

The entries in the rows of cells that the patch reaches are laid out again, and later entries are moved along. The
slabs of all levels over the patch are computed again. The result answers as if all facets had been sorted again; only
the order within a bucket differs, and nothing depends on that order.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_grid import BAND, ENTRIES_PER_FACET, box_over, span_of
from rpf3d_core.detection.bucket_locator import BucketLocator, grid_of
from rpf3d_core.detection.slabs import LEVELS, SHIFT, Slabs, add_normal, clear_block, lean_upwards, raise_over, slab_row
from rpf3d_core.errors import TerrainError
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.memory import Kept, Share
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.terrain.frame import FloatArray

Plan = tuple[float, float]
"""A point in plan: x, y (m)."""


class Block(NamedTuple):
    """A rectangle of cells: columns left to right - 1 and rows bottom to top - 1."""

    left: int
    right: int
    bottom: int
    top: int


class Entries(NamedTuple):
    """Entries of S facets in the cells of a block, row by row: cell k holds ids[starts[k] : starts[k + 1]].

    starts : (cells + 1,); ids : (E,) numbers of facets, below S
    """

    starts: NDArray[np.int64]
    ids: NDArray[np.int32]


def block_of(corners: FloatArray, locator: BucketLocator, slack: float) -> Block:
    """Return the cells that the box in plan of some facets, corners (S, 9) m, touches, widened by a slack (m)."""
    sides = np.empty(4, np.int64)
    _block(corners, slack, *grid_of(locator), sides)
    return Block(*sides.tolist())


def facets_in(locator: BucketLocator, block: Block) -> NDArray[np.int64]:
    """Return the facets (N,) in the cells of a block, in ascending order."""
    rows = (row * locator.nx for row in range(block.bottom, block.top))
    parts = [locator.ids[locator.starts[row + block.left] : locator.starts[row + block.right]] for row in rows]
    ids = np.sort(np.concatenate(parts)) if parts else np.empty(0, np.int32)
    first = np.ones(len(ids), dtype=bool)
    first[1:] = ids[1:] != ids[:-1]
    return ids[first].astype(np.int64)


def entries_of(corners: FloatArray, locator: BucketLocator, block: Block, slack: float, most: int) -> Entries:
    """Return facets, corners (S, 9) m, sorted into the cells of a block.

    slack : m by which the box of a facet is widened; most : largest number of entries
    Raises TerrainError if the facets have more entries than that.
    """
    starts = np.zeros((block.right - block.left) * (block.top - block.bottom) + 1, np.int64)
    if not _count_some(corners, slack, *grid_of(locator), *block, most, starts):
        raise TerrainError("the facets of the patch are far wider than those of the ground; publish the whole terrain")
    np.cumsum(starts, out=starts)
    ids = np.empty(int(starts[-1]), np.int32)
    _fill_some(corners, slack, *grid_of(locator), *block, starts[:-1].copy(), ids)
    return Entries(starts, ids)


def patched_locator(
    locator: BucketLocator, facets: Facets, gone: NDArray[np.bool_], rows: NDArray[np.int32], block: Block,
    entries: Entries, memory: Kept, share: Share,
) -> BucketLocator:  # fmt: skip
    """Return the buckets with some facets removed and others added, edited in place: do not use `locator` afterwards.

    gone : (F,) True for facets to remove, by their numbers in the present entries
    rows : (S,) numbers of the new facets; `facets` already holds their corners
    block : cells of all facets that are removed or added; entries : the new facets in the cells of that block
    memory : holds the arrays of the locator; share : runs the work
    """
    nx, band = locator.nx, slice(block.bottom * locator.nx, block.top * locator.nx + 1)
    before = locator.starts[band]
    counts = np.zeros(len(before), np.int64)
    _count_kept(locator.starts, locator.ids, gone, nx, *block, entries.starts, counts)
    np.cumsum(counts, out=counts)
    counts += before[0]
    ids, boxes = np.empty(counts[-1] - before[0], np.int32), np.empty(counts[-1] - before[0], np.uint32)
    _lay_band(
        locator.starts, locator.ids, locator.boxes, gone, facets.corners, REACH * facets.tolerance, *grid_of(locator),
        *block, entries.starts, entries.ids, rows, ids, boxes,
    )  # fmt: skip
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
    """Move the elements from `begin` to `end` by `shift` places within the array; NumPy copies as `memmove` does."""
    if shift:
        array[begin + shift : end + shift] = array[begin:end]


def most_entries(facets: int) -> int:
    """Return how many entries a number of facets may have: the same limit as for a full sort."""
    return ENTRIES_PER_FACET * facets


def _whole_cells(block: Block, locator: BucketLocator) -> Block:
    """Return the block widened to whole cells of the coarsest level."""
    low, high = (block.left, block.bottom), (block.right, block.top)
    (left, bottom), (right, top) = (
        tuple(k // BAND * BAND for k in low), tuple(-(-k // BAND) * BAND for k in high),
    )  # fmt: skip
    return Block(left, min(right, locator.nx), bottom, min(top, locator.ny))


def _over_block(locator: BucketLocator, facets: Facets, block: Block, share: Share) -> None:
    """Compute the slabs over a block of whole cells again, one column of the widest cells after another."""
    slabs: Slabs = locator.slabs
    planes, slack = slabs.planes.reshape(-1, 4), REACH * facets.tolerance
    some = [(a, min(a + BAND, block.right)) for a in range(block.left, block.right, BAND)]
    buckets = locator.starts, locator.ids
    share([
        lambda a=a, b=b: _renew_slabs(  # type: ignore[misc]
            facets.corners, facets.normals, slack, *grid_of(locator), *buckets, a, b, block.bottom, block.top, planes,
            slabs.first,
        )
        for a, b in some
    ])  # fmt: skip


@loop
def _block(corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, sides: Any) -> None:
    """Write left, right, bottom and top of the `Block` around some facets into `sides`."""
    sides[0], sides[1], sides[2], sides[3] = nx, 0, ny, 0
    for f in range(corners.shape[0]):
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        sides[0], sides[1] = min(sides[0], i0), max(sides[1], i1 + 1)
        sides[2], sides[3] = min(sides[2], j0), max(sides[3], j1 + 1)


@loop
def _count_some(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, left: int, right: int, bottom: int,
    top: int, most: int, starts: Any,
) -> bool:  # fmt: skip
    """Count the entries of cell k of a block into starts[k + 1]; stop and return False if they exceed `most`."""
    entries = 0
    for f in range(corners.shape[0]):
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        entries += (i1 - i0 + 1) * (j1 - j0 + 1)
        if entries > most:
            return False
        for j in range(max(j0, bottom), min(j1 + 1, top)):
            for i in range(max(i0, left), min(i1 + 1, right)):
                starts[(j - bottom) * (right - left) + i - left + 1] += 1
    return True


@loop
def _fill_some(
    corners: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, left: int, right: int, bottom: int,
    top: int, cursor: Any, ids: Any,
) -> None:  # fmt: skip
    """Write the facet of each entry in a block into `ids`; `cursor` holds the next free place of each cell."""
    for f in range(corners.shape[0]):
        i0, i1 = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
        j0, j1 = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
        for j in range(max(j0, bottom), min(j1 + 1, top)):
            for i in range(max(i0, left), min(i1 + 1, right)):
                k = (j - bottom) * (right - left) + i - left
                ids[cursor[k]] = f
                cursor[k] += 1


@loop
def _count_kept(
    starts: Any, ids: Any, gone: Any, nx: int, left: int, right: int, bottom: int, top: int, come: Any, counts: Any
) -> None:
    """Count how many entries each bucket of a block's rows will have, into the place after the bucket's own."""
    for j in range(bottom, top):
        for i in range(nx):
            k, stay = j * nx + i, 0
            if left <= i < right:
                for entry in range(starts[k], starts[k + 1]):
                    stay += 0 if gone[ids[entry]] else 1
                c = (j - bottom) * (right - left) + i - left
                stay += come[c + 1] - come[c]
            else:
                stay = starts[k + 1] - starts[k]
            counts[k - bottom * nx + 1] = stay


@loop
def _lay_band(
    starts: Any, ids: Any, boxes: Any, gone: Any, corners: Any, slack: float, x: float, y: float, cell: float, nx: int,
    ny: int, left: int, right: int, bottom: int, top: int, come: Any, come_ids: Any, rows: Any, new_ids: Any,
    new_boxes: Any,
) -> None:  # fmt: skip
    """Write the entries of the buckets of a block's rows: first the facets that stay, then the new facets."""
    at = 0
    for j in range(bottom, top):
        for i in range(nx):
            k = j * nx + i
            inside = left <= i < right
            for entry in range(starts[k], starts[k + 1]):
                if not (inside and gone[ids[entry]]):
                    new_ids[at], new_boxes[at] = ids[entry], boxes[entry]
                    at += 1
            if inside:
                c = (j - bottom) * (right - left) + i - left
                for entry in range(come[c], come[c + 1]):
                    f = rows[come_ids[entry]]
                    new_ids[at], new_boxes[at] = f, box_over(corners, f, slack, x, y, 1.0 / cell, i, j)
                    at += 1


@loop
def _add_to(array: Any, begin: int, amount: int) -> None:
    """Add an amount to all elements from `begin` on."""
    for k in range(begin, len(array)):
        array[k] += amount


@loop
def _renew_slabs(
    corners: Any, normals: Any, slack: float, x: float, y: float, cell: float, nx: int, ny: int, starts: Any, ids: Any,
    left: int, right: int, bottom: int, top: int, planes: Any, first: Any,
) -> None:  # fmt: skip
    """Compute the slabs over a block of whole cells again, from the entries of its buckets."""
    clear_block(nx, left, right, bottom, top, planes, first)
    for j in range(bottom, top):
        for i in range(left, right):
            for entry in range(starts[j * nx + i], starts[j * nx + i + 1]):
                add_normal(normals, ids[entry], planes, j * nx + i)
    lean_upwards(nx, left, right, bottom, top, planes, first)
    for j in range(bottom, top):
        for i in range(left, right):
            for entry in range(starts[j * nx + i], starts[j * nx + i + 1]):
                _raise_levels(corners, ids[entry], slack, x, y, cell, nx, ny, i, j, planes, first)


@kernel
def _raise_levels(
    corners: Any, f: int, slack: float, x: float, y: float, cell: float, nx: int, ny: int, i: int, j: int, planes: Any,
    first: Any,
) -> None:  # fmt: skip
    """Raise the slabs over the bucket in column i and row j above facet f.

    The slab of a wider cell is raised only if this bucket is the first bucket of f in that cell.
    """
    raise_over(corners, f, planes, slab_row(first, nx, 0, i, j))
    i0, _ = span_of(corners[f, 0], corners[f, 3], corners[f, 6], slack, x, cell, nx)
    j0, _ = span_of(corners[f, 1], corners[f, 4], corners[f, 7], slack, y, cell, ny)
    for level in range(1, LEVELS):
        shift = SHIFT * level
        if i == max(i0, (i >> shift) << shift) and j == max(j0, (j >> shift) << shift):
            raise_over(corners, f, planes, slab_row(first, nx, level, i >> shift, j >> shift))
