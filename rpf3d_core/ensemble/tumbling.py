"""Compute the orientation of rocks with a shape along their paths, between recorded events, for pictures and exports.

Every path segment of a rock with a shape is a free flight, so the orientation follows in closed form from the
orientation and the spin at the start of the segment (`body.rotation`). No orientation is interpolated.
"""

from typing import Any

import numpy as np

from rpf3d_core.body.rotation import Turning, turned_for, turning_of
from rpf3d_core.ensemble.flights import FloatArray, IntArray, Paths
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.values import Mode

IN_PYTHON = 100_000
"""Largest number of orientations that plain Python computes.

Python takes about 20 us for one orientation; the compilation takes 6 s, once on each machine.
"""


def orientations_along(
    paths: Paths, piece: IntArray, elapsed: FloatArray, inside: Any, moments: FloatArray
) -> FloatArray:
    """Return the orientations (S, 4), w x y z, of rocks at S times on their path segments.

    The orientations follow from the exact solution for free rotation. The result has the same bits whether plain Python
    or compiled code computes it.

    piece : (S,) row in `Paths` of the event that begins each segment, ascending; elapsed : (S,) s since this event
    inside : (S,) True if the time is before the end of the segment; False for the end itself, where the orientation at
        the next event is returned
    moments : (R, 3) principal moments of each rock, ascending, by row in `Deposits`; in any unit, because only the
        ratios of a rock's three moments count

    Raises
    ------
    ValueError
        The paths are those of points or spheres, which have no orientation.
    """
    if paths.q is None or paths.w is None:
        raise ValueError("the paths of points and spheres have no orientation")
    after = np.where(inside | (paths.mode[piece] == Mode.END), piece, np.minimum(piece + 1, len(paths.row) - 1))
    q: FloatArray = paths.q[after]
    turns = np.flatnonzero(inside & (elapsed > 0.0) & (paths.mode[piece] != Mode.END))
    if not len(turns):
        return q
    segments, number = np.unique(piece[turns], return_inverse=True)
    starts = (np.ascontiguousarray(values[segments]) for values in (paths.q, paths.w))
    turn_all: Any = _turn_all if len(turns) > IN_PYTHON else _turn_all.py_func  # type: ignore[attr-defined]
    turned = np.empty((len(turns), 4))
    turn_all(np.ascontiguousarray(moments[paths.row[segments]]), *starts, number, elapsed[turns], turned)
    q[turns] = turned
    return q


@kernel
def _turning(moments: Any, q: Any, w: Any, i: int) -> Turning:
    """Return the free rotation from the start of segment i; moments, w, q : of all segments, as in `_turn_all`."""
    return turning_of(
        (float(moments[i, 0]), float(moments[i, 1]), float(moments[i, 2])),
        (float(q[i, 0]), float(q[i, 1]), float(q[i, 2]), float(q[i, 3])),
        (float(w[i, 0]), float(w[i, 1]), float(w[i, 2])),
    )


@loop
def _turn_all(moments: Any, q: Any, w: Any, segment: Any, t: Any, out: Any) -> None:
    """Write the orientations of bodies t (P,) s after the start of their segments into out (P, 4).

    moments : (N, 3) principal moments of the rock of each of N segments
    w, q : (N, 3) rad/s and (N, 4), spin and orientation at the start of each segment
    segment : (P,) number of the segment to which each time belongs
    """
    begun = -1
    turning = _turning(moments, q, w, 0)
    for i in range(len(t)):
        if segment[i] != begun:
            begun = segment[i]
            turning = _turning(moments, q, w, begun)
        turn, _ = turned_for(turning, float(t[i]))
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = turn
