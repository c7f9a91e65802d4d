"""Make the points of a pit in columns: each column is a profile from the floor outwards to the natural ground.

A row is a line of points around the pit, such as a crest or a toe. Rows end where the ramp cuts them, so columns differ
in their number of points. Each point has two sorting keys: one for the triangles to the next column, one for the
triangles to the previous column. The keys give the common order of the points of two neighbouring columns, and an edge
joins two points of equal key. Crests, toes and the edges of the ramp are therefore lines of edges in the mesh.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.pit.design import Design
from rpf3d_core.terrain.pit.rows import BENCH, CREST, FACE, TOE, Rows, rows_of

IndexArray = NDArray[np.int64]
Mask = NDArray[np.bool_]

SECTION = 1.0e6
"""Difference of the sorting keys between neighbouring sections of a profile (wall, ramp, wall, ...).

The difference is far above any row number or offset.
"""
GROUND_KEY, FLOOR_KEY = 5.0e5, -2.0e4
"""Sorting keys of points on the ground outside the pit and on the floor, at offset 0.

A point's key is this value plus its offset in m; on the ground, also plus the keys of the sections below.
"""
OUTWARD_GROWTH = 1.5
"""Edge length on the natural ground over the edge length in the pit (-)."""


class Spacing(NamedTuple):
    """The target length of the mesh edges (edge, m), and distances that depend on this length."""

    edge: float

    @property
    def feature_gap(self) -> float:
        """Distance (m) to the ramp's edge within which toes and crests merge with the edge, to avoid thin triangles."""
        return min(0.15 * self.edge, 0.5)

    @property
    def row_gap(self) -> float:
        """Distance (m) to the ramp's edge within which all other rows of points are merged with the edge."""
        return 0.4 * self.edge


class Columns(NamedTuple):
    """The P points of a pit in N columns (profiles from the floor outwards), sorted by column, then outwards.

    column : (P,) number of the column; offset : (P,) m, from the floor outline; height : (P,) m above the floor
    key_ahead : (P,) sorting key of the point for the triangles between its column and the next column
    key_behind : (P,) sorting key of the point for the triangles between its column and the previous column
    row : (P,) index into `rows`, -1 off the wall; ramp : (P,) turn of the ramp, from 0, at the point; -1 off the ramp
    at_foot, at_top : (P,) true if the point is on the first, or the last, line across the ramp
    rows : the W rows of the wall; wall : (W, N) m, offset of every row in every column, also of points left out
    around : number of columns N
    """

    column: IndexArray
    offset: FloatArray
    height: FloatArray
    key_ahead: FloatArray
    key_behind: FloatArray
    row: IndexArray
    ramp: IndexArray
    at_foot: Mask
    at_top: Mask
    rows: Rows
    wall: FloatArray
    around: int


class RampTurn(NamedTuple):
    """One turn of the ramp, where it crosses the N columns; every array is (N,).

    exists : true where the ramp exists; face : number of the bench face that the ramp cuts
    part : share of the height of this bench face that is below the ramp (-); height : of the ramp, m
    inner, outer : offsets of the ramp's edges from the floor outline, m
    coordinate : bench coordinate of the height (-), see `Design.bench_coordinate`
    """

    exists: Mask
    face: FloatArray
    part: FloatArray
    height: FloatArray
    inner: FloatArray
    outer: FloatArray
    coordinate: FloatArray


class Points(NamedTuple):
    """One group of points, such as the wall or the floor, to be joined to columns; all arrays are (M, N).

    There are M points in each of N columns.

    offset : m, from the floor outline; height : m, above the floor
    row : index of the row of the wall, -1 off the wall; ramp : turn of the ramp, from 0, -1 off the ramp
    key : sorting key of the point within its column; valid : false for points that are left out
    """

    offset: FloatArray
    height: FloatArray
    key: FloatArray
    row: IndexArray
    ramp: IndexArray
    valid: Mask


def columns_of(design: Design, spacing: Spacing, count: int) -> Columns:
    """Return the points of a pit in `count` columns (profiles from the floor to the natural ground).

    Column k is at the fraction k / `count` of a turn around the pit, counter-clockwise from the foot of the ramp.
    """
    last = round(design.turns * count) if design.turns > 0.0 else -1
    crossings = [crossing_of(design, count, last, turn) for turn in range(last // count + 1)]
    rows = rows_of(design, spacing.edge)
    wall = wall_points(design, rows, crossings, np.arange(count) / count, spacing)
    ramps = [ramp_points(design, crossing, turn, spacing) for turn, crossing in enumerate(crossings)]
    floor, ground = floor_points(design, wall, spacing), ground_points(design, wall, crossings, spacing)
    return joined([floor, wall, *ramps, ground], rows, last)


def crossing_of(design: Design, count: int, last: int, turn: int) -> RampTurn:
    """Return where one turn of the ramp crosses the columns: its height and the offsets of its edges in each column.

    count : number of columns; turn : number of the turn, from 0
    last : number of columns from the foot of the ramp to its top, over all turns
    """
    step = np.arange(count) + turn * count
    height = design.ramp_height(np.minimum(step, last) * (design.turns / last))
    coordinate = design.bench_coordinate(height)
    face = np.maximum(np.ceil(coordinate), 1.0)
    inner = design.wall_offset(np.arange(count) / count, height, coordinate - 1.0, turn)
    return RampTurn(
        exists=step <= last,
        face=face,
        part=coordinate - face + 1.0,
        height=height,
        inner=inner,
        outer=inner + design.strip,
        coordinate=coordinate,
    )


def wall_points(design: Design, rows: Rows, crossings: list[RampTurn], p: FloatArray, spacing: Spacing) -> Points:
    """Return the points of bench faces and benches in all columns, moved to make room for the ramp.

    Points above a turn of the ramp move outwards; faces that the ramp cuts move so that berms taper (`taper`). Points
    that the ramp replaces (`merges`), and points on a berm that is too narrow for them (`crowds`), are not valid.

    crossings : the turns of the ramp; p : (N,) place of each column, as fraction of a turn around the pit
    """
    shape = (len(rows.kind), len(p))
    below = np.zeros(shape)
    for crossing in crossings:
        below += crossing.exists & (crossing.coordinate <= rows.coordinate[:, None])
    below[0] = 0.0  # the edge of the floor lies inside the foot of the ramp
    offset = design.wall_offset(p, rows.height[:, None], rows.berms[:, None], below)
    valid = np.ones(shape, dtype=bool)
    for crossing in crossings:
        offset += taper(rows, crossing, design.width_at(p))
        valid &= ~merges(rows, crossing, offset, spacing) & ~crowds(rows, crossing, design.width_at(p), spacing)
    height = np.broadcast_to(rows.height[:, None], shape)
    row = np.broadcast_to(np.arange(shape[0])[:, None], shape)
    return Points(
        offset=offset, height=height, key=2.0 * SECTION * below + row, row=row, ramp=np.full(shape, -1), valid=valid
    )


def taper(rows: Rows, crossing: RampTurn, width: FloatArray) -> FloatArray:
    """Return the distance (W, N), m, by which the rows of a face that the ramp cuts move outwards, so that berms taper.

    The distance is negative for the rows below the ramp, and 0 for all faces that the ramp does not cut.

    Let f be the share of the face that lies below the ramp, and w the bench width. The berm at the toe of the face is
    then f w wide, and the berm at the crest of the face (1 - f) w. Along the climbing ramp, the lower berm widens and
    the upper berm narrows.

    crossing : the turn of the ramp that cuts the bench faces; width : (N,) m, bench width in each column
    """
    kind = rows.kind[:, None]
    cut = crossing.exists & (rows.face[:, None] == crossing.face) & (kind != BENCH)
    lower = (kind == TOE) | ((kind == FACE) & (rows.coordinate[:, None] < crossing.coordinate))
    move = np.where(lower, (crossing.part - 1.0) * width, crossing.part * width)
    return np.where(cut, move, 0.0)


def crowds(rows: Rows, crossing: RampTurn, width: FloatArray, spacing: Spacing) -> Mask:
    """Return flags (W, N): true for points of inner bench rows that are omitted, because a tapered berm is too narrow.

    crossing : the turn of the ramp that tapers the berms; width : (N,) m, bench width in each column
    """
    bench, place = (rows.kind == BENCH)[:, None], (rows.berms - np.floor(rows.berms))[:, None] * width
    edge, margin = crossing.part * width, np.minimum(spacing.row_gap, 0.25 * width)
    steps_up = rows.face[:, None] - crossing.face
    narrow: Mask = ((steps_up == -1.0) & (place > edge - margin)) | ((steps_up == 0.0) & (place < edge + margin))
    narrow &= bench & crossing.exists
    return narrow


def merges(rows: Rows, crossing: RampTurn, offset: FloatArray, spacing: Spacing) -> Mask:
    """Return flags (W, N): true for points that nearly coincide with an edge of the ramp, or would give thin triangles.

    Points of the ramp replace these points. Also replaced are the toe and the crest of the face that the ramp cuts
    where the height of the ramp differs from theirs by less than `spacing.feature_gap`.

    crossing : one turn of the ramp; offset : (W, N) m, of the points from the floor outline
    """
    feature = ((rows.kind == TOE) | (rows.kind == CREST))[:, None]
    gap = np.where(feature, spacing.feature_gap, spacing.row_gap)
    rise = np.abs(rows.height[:, None] - crossing.height)
    run = np.minimum(np.abs(offset - crossing.inner), np.abs(offset - crossing.outer))
    thin: Mask = feature & (rows.face[:, None] == crossing.face) & (rise < spacing.feature_gap)
    near: Mask = crossing.exists & (thin | (np.hypot(rise, run) < gap))
    return near


def ramp_points(design: Design, crossing: RampTurn, turn: int, spacing: Spacing) -> Points:
    """Return the points of the haul ramp on one turn around the pit.

    Each column has a line of points across the ramp, all at the same height.

    crossing : where the ramp crosses the columns on this turn; turn : number of the turn, from 0
    """
    parts = max(1, round(design.strip / spacing.edge))
    across = np.arange(parts + 1)[:, None]
    offset = crossing.inner + across * (design.strip / parts)
    shape = offset.shape
    key = np.broadcast_to((2.0 * turn + 1.0) * SECTION + across, shape)
    valid = np.broadcast_to(crossing.exists, shape)
    return Points(
        offset=offset,
        height=np.broadcast_to(crossing.height, shape),
        key=key,
        row=np.full(shape, -1),
        ramp=np.full(shape, turn),
        valid=valid,
    )


def floor_points(design: Design, wall: Points, spacing: Spacing) -> Points:
    """Return the points of the pit floor's outer part: lines around the pit inside the toe of the lowest bench face.

    wall : the points of the wall; their first row is this toe, which the result does not repeat
    """
    reach = wall.offset[0] - design.inner
    parts = max(1, round(float(reach.mean()) / spacing.edge))
    offset = design.inner + np.arange(parts)[:, None] / parts * reach
    return flat(offset, np.zeros_like(offset), FLOOR_KEY + offset)


def ground_points(design: Design, wall: Points, crossings: list[RampTurn], spacing: Spacing) -> Points:
    """Return the points of the natural ground outside the crest; the ground is still level, relief is added later.

    wall : the points of the wall, whose last row is the crest; crossings : the turns of the ramp
    """
    crest = wall.offset[-1]
    parts = max(2, round((design.outer - float(crest.mean())) / (OUTWARD_GROWTH * spacing.edge)))
    offset = crest + np.arange(1, parts + 1)[:, None] / parts * (design.outer - crest)
    section = 2.0 * SECTION * sum((c.exists for c in crossings), np.zeros(len(crest)))
    return flat(offset, np.full_like(offset, design.pit.levels[-1]), section + GROUND_KEY + offset)


def flat(offset: FloatArray, height: FloatArray, key: FloatArray) -> Points:
    """Return a group of points (M, N) that are neither on the wall nor on the ramp, such as the floor.

    offset, height : (M, N) m; key : (M, N) sorting keys
    """
    nowhere = np.full(offset.shape, -1)
    return Points(
        offset=offset, height=height, key=key, row=nowhere, ramp=nowhere, valid=np.ones(offset.shape, dtype=bool)
    )


def joined(blocks: list[Points], rows: Rows, last: int) -> Columns:
    """Return the valid points of all groups (floor, wall, ramp, ground) in one `Columns`, sorted by column and key.

    blocks : the groups; the second must be the wall
    last : number of columns from the foot of the ramp to its top, over all turns; -1 for a pit without a ramp
    """
    count = blocks[0].offset.shape[1]
    valid = np.concatenate([block.valid for block in blocks])
    column = np.broadcast_to(np.arange(count), valid.shape)[valid]
    offset, height, key, row, ramp = (
        np.concatenate([block[field] for block in blocks])[valid] for field in range(len(Points._fields) - 1)
    )
    order = np.lexsort((key, column))
    column, offset, height, key, row, ramp = (a[order] for a in (column, offset, height, key, row, ramp))
    at_foot, at_top = (ramp >= 0) & (column + ramp * count == 0), (ramp >= 0) & (column + ramp * count == last)
    ahead = key_at_top(column, offset, key, at_top, len(rows.kind), last % count if last >= 0 else -1)
    behind = key_at_foot(column, offset, key, at_foot)
    return Columns(
        column=column,
        offset=offset,
        height=height,
        key_ahead=ahead,
        key_behind=behind,
        row=row,
        ramp=ramp,
        at_foot=at_foot,
        at_top=at_top,
        rows=rows,
        wall=blocks[1].offset,
        around=count,
    )


def key_at_top(
    column: IndexArray, offset: FloatArray, key: FloatArray, at_top: Mask, rows: int, last: int
) -> FloatArray:
    """Return the sorting keys (P,) of points for the triangles to the next column, corrected at the top of the ramp.

    For these triangles, the last line across the ramp is natural ground, and the inner end of the line is the crest.

    column, offset : (P,) column number, and offset (m) from the floor outline, of the points
    key : (P,) sorting keys before the correction
    at_top : (P,) true for points on the last line across the ramp
    rows : number of rows of the wall; last : column of the last line across the ramp, -1 without a ramp
    """
    if not at_top.any():
        return key
    key, edge = key.copy(), np.flatnonzero(at_top)[0]
    section = key[edge] - SECTION
    key[(column == last) & (key > section + 2.0 * SECTION)] -= 2.0 * SECTION
    key[at_top] = section + GROUND_KEY + offset[at_top]
    key[edge] = section + rows - 1
    return key


def key_at_foot(column: IndexArray, offset: FloatArray, key: FloatArray, at_foot: Mask) -> FloatArray:
    """Return the sorting keys (P,) of points for the triangles to the previous column, corrected at the ramp's foot.

    For these triangles, the first line across the ramp is floor, and the outer end of the line is the toe.

    column, offset : (P,) column number, and offset (m) from the floor outline, of the points
    key : (P,) sorting keys before the correction
    at_foot : (P,) true for points on the first line across the ramp
    """
    if not at_foot.any():
        return key
    key, edge = key.copy(), np.flatnonzero(at_foot)[-1]
    key[(column == 0) & (key >= SECTION)] -= 2.0 * SECTION
    key[at_foot] = FLOOR_KEY + offset[at_foot]
    key[edge] = 0.0
    return key
