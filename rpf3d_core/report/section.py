"""Find the critical section of a run: a vertical section through the release of the rock that stopped farthest away.

The direction of the section is the mean direction of all rocks that start near this release.
"""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.toe import directions
from rpf3d_core.terrain.faces import STEEP, foot_of_face
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import height_image, heights_at

POINTS = 600
"""Number of points of the terrain's profile."""
WIDTH = 0.2
"""Width of the strip along the section in which paths are drawn, as a share (-) of the largest runout."""
NARROWEST = 10.0
"""Smallest width (m) of the strip."""
BESIDE = 0.25
"""Distance (m) on each side of a place over which the slope of the ground is measured."""
BEHIND, AHEAD = 0.15, 0.1
"""Extension of the section behind the release and beyond the farthest end of a rock.

Both are shares (-) of the distance between the release and this end.
"""


class CriticalSection(NamedTuple):
    """The critical section; distances (m) are measured in plan, along the section, from the release of one rock.

    key : this rock, which stopped farthest from its release, as (source, rock, fragment); runout : of this rock, m
    toe : distance (m) of the foot of the first face; NaN without a face below the release
    distance, ground : (S,) m, the terrain's profile, elevations in the input's vertical coordinate
    paths : (P, 2) m for each kept path in a strip along the section: distance and elevation of its points, NaN for
        points outside the strip; width : m, width of the strip
    path : (P, 2) m, the path of this rock, distance and elevation; None if the result does not have this path
    start : (2,) m, the release in z-up input coordinates; azimuth : direction of the section, degrees clockwise from
        north; downhill : mean direction in which the faces between the release and the end of the section fall,
        likewise; NaN without faces
    """

    key: tuple[str, int, int]
    runout: float
    toe: float
    distance: FloatArray
    ground: FloatArray
    paths: list[FloatArray]
    path: FloatArray | None
    width: float
    start: FloatArray
    azimuth: float
    downhill: float

    @property
    def obliquity(self) -> float:
        """The angle (degrees, 0 to 180) between the section and the direction in which its faces fall; may be NaN."""
        return abs((self.azimuth - self.downhill + 180.0) % 360.0 - 180.0)


def critical_section(run: RunFiles) -> CriticalSection | None:
    """Return the critical section of a run; None if no rock stopped, or all stopped where they were released."""
    ends = run.ends
    rested = np.flatnonzero(ends.at_rest & (ends.runout > 0.0))
    if len(rested) == 0:
        return None
    row = int(rested[np.argmax(ends.runout[rested])])
    start, runout = ends.release[row, :2], float(ends.runout[row])
    width = max(WIDTH * runout, NARROWEST)
    near = np.linalg.norm(ends.release[:, :2] - start, axis=1) <= 0.5 * width
    along = directions(ends)[near].mean(axis=0)
    along = along / np.linalg.norm(along) if np.any(along) else directions(ends)[row]
    length = max(float(((ends.end[near & ends.at_rest, :2] - start) @ along).max()), 1.0)
    distance = np.linspace(-BEHIND * length, (1.0 + AHEAD) * length, POINTS)
    line = start + distance[:, None] * along
    ground = heights_at(height_image(run.terrain, line, 1.0), line)
    ahead = distance >= 0.0
    toe = foot_of_face(distance[ahead], ground[ahead])
    east, north, up = run.terrain.frame.origin
    return CriticalSection(
        key=ends.key[row], runout=runout, toe=toe, distance=distance, ground=ground + up,
        paths=_in_strip(run, start, along, width), path=_onto(run, run.path_of(ends.key[row]), start, along),
        width=width, start=start + np.array([east, north]),
        azimuth=_azimuth(along), downhill=_downhill(run, line[ahead]),
    )  # fmt: skip


def _azimuth(direction: FloatArray) -> float:
    """Return a direction (2,) in plan in degrees clockwise from north, 0 to 360."""
    return float(np.degrees(np.arctan2(direction[0], direction[1])) % 360.0)


def _downhill(run: RunFiles, places: FloatArray) -> float:
    """Return the mean direction in which the faces at places (N, 2) m in plan fall; NaN if no place is on a face.

    The direction is in degrees clockwise from north. A face is steeper than STEEP (degrees).
    """
    shifts = np.array([(BESIDE, 0.0), (-BESIDE, 0.0), (0.0, BESIDE), (0.0, -BESIDE)])
    image = height_image(run.terrain, np.concatenate([places + shift for shift in shifts]), 2.0 * BESIDE)
    east, west, north, south = (heights_at(image, places + shift) for shift in shifts)
    fall = np.column_stack([west - east, south - north]) / (2.0 * BESIDE)
    steepness = np.linalg.norm(fall, axis=1)
    faces = steepness > math.tan(math.radians(STEEP))  # False where the ground is not known
    if not faces.any():
        return math.nan
    return _azimuth(np.asarray((fall[faces] / steepness[faces, None]).mean(axis=0)))


def _onto(run: RunFiles, path: FloatArray | None, start: FloatArray, along: FloatArray) -> FloatArray | None:
    """Return a path (P, 3) m projected onto a vertical section: distances along the section and elevations (P, 2) m.

    The result is None if `path` is None.

    start, along : (2,) m, local frame, and (2,) unit vector of the line of the section in plan
    """
    if path is None:
        return None
    return np.column_stack([(path[:, :2] - start) @ along, path[:, 2] + run.terrain.frame.origin[2]])


def _in_strip(run: RunFiles, start: FloatArray, along: FloatArray, width: float) -> list[FloatArray]:
    """Return the kept paths that touch a strip along a line: (P, 2) m, distance and elevation; NaN outside the strip.

    start, along : (2,) m, local frame, and (2,) unit vector of the line; width : width of the strip (m)
    """
    across, found = np.array([-along[1], along[0]]), []
    for begin, end in zip(run.paths.starts[:-1], run.paths.starts[1:], strict=True):
        away = run.paths.x[begin:end, :2] - start
        outside = np.abs(away @ across) > 0.5 * width
        heights = run.paths.x[begin:end, 2] + run.terrain.frame.origin[2]
        if not outside.all():
            found.append(np.where(outside[:, None], np.nan, np.column_stack([away @ along, heights])))
    return found
