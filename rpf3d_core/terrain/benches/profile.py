"""The profile of a slope of benches: its points from the crest down to the floor, in a plane across the faces."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.pit.relief import SMOOTH_SHARE

CREST, FACE, BERM, FLOOR = "crest", "face_", "berm_", "floor"
"""Names of the zones of a slope; for a face or berm, the number is appended, from 1 at the top."""
UPRIGHT = (0.0, 1.0)
"""Direction (x, z) in which relief moves the points of level ground."""
FADE = 3.0
"""Distance (m) from the edges over which relief grows to its full height: the length of the relief's shortest wave.

Edges stay in place. If relief moved them, the face and the level ground next to an edge would move in different
directions, and a fine mesh would cross itself there.
"""


class ProfilePart(NamedTuple):
    """A straight part of the profile, such as a face or a berm.

    zone : name of the zone; way : (x, z) m, vector from the upper end of the part to its lower end
    normal : (x, z) unit, direction in which relief moves the points of the part
    rough : share of the full relief that the part has (-)
    """

    zone: str
    way: tuple[float, float]
    normal: tuple[float, float] = UPRIGHT
    rough: float = 1.0


class Profile(NamedTuple):
    """The P points of a profile, from the crest down, and the P - 1 strips between them.

    points : (P, 2) x and z, m; normal : (P, 2) unit, direction in which relief moves a point
    rough : (P,) share of the full relief at each point (-)
    zone : (P - 1,) index into `zones` of each strip; zones : names from the top
    edges : for each part (crest, face, berm, ..., floor), the number of its first (uppermost) point, from 0
    """

    points: FloatArray
    normal: FloatArray
    rough: FloatArray
    zone: IntArray
    zones: tuple[str, ...]
    edges: list[int]


def parts_of(benches: Benches) -> Iterator[ProfilePart]:
    """Yield the parts of a profile from the crest down: crest, faces and berms in turn, floor."""
    slant = math.hypot(benches.height, benches.run)
    way, normal = (benches.run, -benches.height), (benches.height / slant, benches.run / slant)
    yield ProfilePart(CREST, (benches.crest, 0.0))
    for face in range(1, benches.number + 1):
        yield ProfilePart(f"{FACE}{face}", way, normal)
        if face < benches.number and benches.berm > 0.0:
            yield ProfilePart(f"{BERM}{face}", (benches.berm, 0.0))
    yield ProfilePart(FLOOR, (benches.floor, 0.0), rough=SMOOTH_SHARE)


def profile_of(benches: Benches) -> Profile:
    """Return the profile of a slope, with one point at each edge of the mesh's cells.

    x is horizontal, 0 at the upper edge of the highest face, and increases from the crest to the floor. z is 0 on the
    floor. The profile consists of straight parts: crest, faces, berms and floor. Relief moves points at right angles to
    their part, but does not move the ends of a part, so each berm keeps its width.
    """
    parts = list(parts_of(benches))
    counts = [benches.cells(length) for length in benches.lengths]
    start = (-benches.crest, benches.number * benches.height)
    corners = np.cumsum([start, *(part.way for part in parts)], axis=0)
    points, normals, rough = [corners[:1]], [np.array([UPRIGHT])], [np.zeros(1)]
    for part, count, begin, end in zip(parts, counts, corners[:-1], corners[1:], strict=True):
        share = np.arange(1, count + 1) / count
        points.append(begin + share[:, None] * (end - begin))
        normals.append(np.tile(part.normal, (count, 1)))
        rough.append(part.rough * _faded(share, float(np.hypot(*(end - begin)))))
    return Profile(
        points=np.concatenate(points), normal=np.concatenate(normals), rough=np.concatenate(rough),
        zone=np.repeat(np.arange(len(parts), dtype=np.int32), counts), zones=tuple(part.zone for part in parts),
        edges=[0, *np.cumsum(counts)[:-1].tolist()],
    )  # fmt: skip


def _faded(share: FloatArray, length: float) -> FloatArray:
    """Return the share (N,) of the full relief at places along a part: 0 at both ends, 1 at least FADE (m) from them.

    share : (N,) places along the part, as shares of its length; length : m
    """
    return np.clip(length * np.minimum(share, 1.0 - share) / FADE, 0.0, 1.0)
