"""Write rocks with a shape to a recording as tumbling blocks: each is a mesh that moves and turns over time."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import Deposits, Flights, FloatArray
from rpf3d_core.ensemble.paths import displayed_rows, poses_at
from rpf3d_core.recordings.blueprint import TIMELINE
from rpf3d_core.results.orientations import moments_of
from rpf3d_core.shapes.polyhedron import Polyhedron, scaled_to_volume

BLOCKS = "world/blocks"
"""Name of the entity of a recording that contains all blocks."""

SHOWN_BLOCKS = 48
"""Largest number of rocks that are shown as blocks; further rocks are shown only as points.

48 blocks take about 2 MB.
"""

RATE = 60
"""Number of poses per second that are recorded while a block moves: as many as a screen shows."""

SEEN = 2e-3
"""Smallest visible movement of a corner, as a share (-) of the largest distance of a corner from the block's centre.

A pose is recorded if a corner may have moved farther than this since the last recorded pose.
"""

BLOCK_COLOUR = (196, 120, 62)


def entity_of(deposits: Deposits, row: int) -> str:
    """Return the name of the entity with the block of one rock in a recording; row : row of the rock in `Deposits`."""
    return f"{BLOCKS}/{deposits.source[row]}/{deposits.rock[row]}"


def log_blocks(
    recording: Any, blocks: Sequence[Polyhedron], flights: Flights, density: float, gravity: float
) -> None:  # fmt: skip
    """Write at most SHOWN_BLOCKS (48) rocks with a shape to a recording as moving blocks; nothing without shapes.

    The rocks are evenly spread over the rocks with a path. A block is a mesh of the size of its rock, written once. Its
    position and orientation, in the local frame, are written up to about 60 times a second (RATE) while it moves.

    blocks : shapes by number, empty if rocks have no shape; density : kg/m^3; gravity : m/s^2
    """
    import rerun as rr

    deposits = flights.deposits
    moments = moments_of(blocks, deposits)
    if moments is None or deposits.shape is None:
        return
    for row in displayed_rows(flights.paths, SHOWN_BLOCKS).tolist():
        block = scaled_to_volume(blocks[deposits.shape[row]], float(deposits.mass[row]) / density)
        recording.log(entity_of(deposits, row), _mesh(block), static=True)
        times = frames_of(float(deposits.t[row]))
        x, q = poses_at(flights.paths, row, times, moments, gravity)
        kept = moving_frames(x, q, float(np.linalg.norm(block.corners, axis=1).max()))
        columns = rr.Transform3D.columns(translation=x[kept], quaternion=q[kept][:, [1, 2, 3, 0]])
        recording.send_columns(entity_of(deposits, row), [rr.TimeColumn(TIMELINE, duration=times[kept])], columns)


def frames_of(end: float) -> FloatArray:
    """Return evenly spaced moments (T,) s from 0 to `end` at which a pose may be recorded, at least 60 per second.

    end : last moment (s)
    """
    return np.linspace(0.0, end, math.ceil(end * RATE) + 1)


def moving_frames(x: FloatArray, q: FloatArray, reach: float) -> NDArray[np.int64]:
    """Return the indices (K,) of the poses to record: the first, the last, and each visibly different pose.

    A pose is visibly different if a corner may have moved more than SEEN (0.002) times `reach` since the previous pose
    to record.

    x : (T, 3) m, positions of the centre; q : (T, 4) unit quaternions w, x, y, z
    reach : largest distance of a corner from the centre (m)
    """
    kept = [0]
    for i in range(1, len(x) - 1):
        sine = math.sqrt(max(1.0 - float(q[i] @ q[kept[-1]]) ** 2, 0.0))
        if float(np.linalg.norm(x[i] - x[kept[-1]])) + 2.0 * reach * sine > SEEN * reach:
            kept.append(i)
    return np.array(kept + [len(x) - 1] * (len(x) > 1), dtype=np.int64)


def _mesh(block: Polyhedron) -> Any:
    """Return a block as a mesh for the viewer; faces do not share corners, so that edges look sharp."""
    import rerun as rr

    corners = np.concatenate([block.corners[list(face)] for face in block.faces])
    sizes = [len(face) for face in block.faces]
    firsts = np.cumsum([0, *sizes[:-1]]).tolist()
    fans = [(at, at + k, at + k + 1) for at, size in zip(firsts, sizes, strict=True) for k in range(1, size - 1)]
    return rr.Mesh3D(
        vertex_positions=corners,
        triangle_indices=fans,
        vertex_normals=np.repeat(block.normals, sizes, axis=0),
        albedo_factor=BLOCK_COLOUR,
    )
