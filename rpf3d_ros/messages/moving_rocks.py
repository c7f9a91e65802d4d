"""Convert published trajectories to rock positions at equally spaced times, so that a recording shows the motion."""

from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.refusals import MessageRefused

FRAME = 0.1
"""Time (s) between two pictures of the moving rocks; in this time a rock at 30 m/s moves by a few diameters."""

MOST_FRAMES = 1200
"""Largest number of pictures of an answer, two minutes of motion; longer motion is cut off."""

MOST_ROCKS = 200
"""Largest number of moving rocks, chosen evenly from all rocks; `trajectories/points` contains every rock."""


class RockPositions(NamedTuple):
    """Positions of R rocks at K equally spaced times.

    times : (K,) s after release
    positions : (K, R, 3) m; after the end of its path a rock stays at its last position
    """

    times: FloatArray
    positions: FloatArray


def motion_of(points: FloatArray, t: FloatArray, rock: IntArray) -> RockPositions:
    """Return the positions of at most MOST_ROCKS rocks every FRAME seconds, from the points of their trajectories.

    Between points, the motion is linear. Motion after MOST_FRAMES positions is cut off.

    points : (N, 3) m, grouped by rock, in order of time; t : (N,) s after release; rock : (N,) rock of each point

    Raises MessageRefused for times that are not finite, that are negative, or that decrease along the path of a rock.
    """
    if not bool(np.isfinite(t).all()) or bool((t < 0.0).any()):
        raise MessageRefused("field 't' holds times that are negative or not finite; they are seconds after release")
    begins = np.concatenate([[0], np.flatnonzero(rock[1:] != rock[:-1]) + 1])[: len(rock)]
    ends = np.append(begins[1:], len(rock))
    inside = np.ones(len(t), dtype=bool)
    inside[begins] = False
    if bool((np.diff(t, prepend=0.0)[inside] < 0.0).any()):
        raise MessageRefused("field 't' goes back within a rock; points must be grouped by rock, in order of time")
    shown = np.unique(np.linspace(0, len(begins) - 1, min(len(begins), MOST_ROCKS)).round().astype(np.int64))
    longest = min(float(max((t[ends[i] - 1] for i in shown), default=0.0)), FRAME * (MOST_FRAMES - 1))
    times = FRAME * np.arange(int(np.ceil(longest / FRAME)) + 1 if len(shown) else 0)
    tracks = [_track(points[begins[i] : ends[i]], t[begins[i] : ends[i]], times) for i in shown]
    return RockPositions(times, np.stack(tracks, axis=1) if tracks else np.empty((0, 0, 3)))


def _track(points: FloatArray, t: FloatArray, times: FloatArray) -> FloatArray:
    return np.stack([np.interp(times, t, points[:, axis]) for axis in range(3)], axis=-1)
