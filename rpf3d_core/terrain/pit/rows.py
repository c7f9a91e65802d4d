"""Make the rows of a pit's wall: lines of points around the pit, at the toes, the crests and in between."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.pit.design import Design

Array = NDArray[np.int64]

TOE, FACE, CREST, BENCH = range(4)


class Rows(NamedTuple):
    """The W rows of the pit's wall (lines of points around the pit), in order from the floor up.

    kind : (W,) TOE (lower edge of a face), FACE (on a face), CREST (upper edge of a face) or BENCH (on a bench)
    face : (W,) number of the face, 1 is the lowest; for BENCH rows the face below the bench
    height : (W,) m above the floor, without ramp or roughness
    berms : (W,) number of bench widths between the edge of the floor and the row; not a whole number for a BENCH row
    coordinate : (W,) height as a bench coordinate (`Design.bench_coordinate`)
    """

    kind: Array
    face: Array
    height: FloatArray
    berms: FloatArray
    coordinate: FloatArray


def rows_of(design: Design, edge: float) -> Rows:
    """Return the rows of points of the wall, about `edge` m apart, with a row at every toe and every crest."""
    levels = design.pit.levels
    found: list[tuple[int, int, float, float, float]] = []
    for face in range(1, len(levels)):
        found += face_rows(design, edge, face)
        if design.benches and face < len(levels) - 1:
            found += bench_rows(design, edge, face)
    kind, number, height, berms, coordinate = np.array(found).T
    return Rows(
        kind=kind.astype(np.int64), face=number.astype(np.int64), height=height, berms=berms, coordinate=coordinate
    )


def face_rows(design: Design, edge: float, face: int) -> list[tuple[int, int, float, float, float]]:
    """Return the rows of points of one bench face: toe, inner rows and crest.

    A row is (kind, face, height, berms, coordinate), as in `Rows`. In a pit without catch benches, only the lowest face
    has a toe row.

    edge : m, wanted distance between rows; face : number of the face, 1 is the lowest
    """
    low, high = design.pit.levels[face - 1], design.pit.levels[face]
    parts = max(1, round((high - low) * np.hypot(1.0, design.cot) / edge))
    berms = float(face - 1)
    rows = [(TOE, face, low, berms, berms)] if design.benches or face == 1 else []
    for part in range(1, parts):
        rows.append((FACE, face, low + (high - low) * part / parts, berms, berms + part / parts))
    return [*rows, (CREST, face, high, berms, float(face))]


def bench_rows(design: Design, edge: float, face: int) -> list[tuple[int, int, float, float, float]]:
    """Return the rows of points on the bench above a face, without the rows at both edges of the bench.

    The rows at the edges are the crest of this face and the toe of the next face; `face_rows` returns them. A row is
    (kind, face, height, berms, coordinate), as in `Rows`.

    edge : m, wanted distance between rows; face : number of the face, 1 is the lowest
    """
    parts = max(1, int(np.ceil(float(design.width.mean()) / edge - 0.25)))
    height = design.pit.levels[face]
    return [(BENCH, face, height, face - 1.0 + part / parts, float(face)) for part in range(1, parts)]
