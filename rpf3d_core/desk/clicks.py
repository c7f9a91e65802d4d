"""Turn the places that the user clicks on the terrain into sources and areas of interest."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import polygon_of
from rpf3d_core.terrain.frame import FloatArray, Frame

POINTS, LINE, AREA = "points", "line", "area"
"""Kinds of drawings: release points of a source, a crest line along which rocks start, or an area of interest."""
LEAST = {POINTS: 1, LINE: 2, AREA: 3}
"""Smallest number of clicks for each kind of drawing."""
DECIMALS = 2
"""Number of decimals of a clicked coordinate (m): centimetres."""


class Drawing(NamedTuple):
    """The places that the user has clicked for a new source or area.

    kind : POINTS, LINE or AREA, "" if nothing is drawn; points : N places (x, y, z) m, local frame
    """

    kind: str = ""
    points: tuple[tuple[float, float, float], ...] = ()

    def clicked(self, point: FloatArray) -> "Drawing":
        """Return the drawing with one more place (3,) m; unchanged if its kind is ""."""
        x, y, z = (float(value) for value in point)
        return self._replace(points=(*self.points, (x, y, z))) if self.kind else self

    def undone(self) -> "Drawing":
        """Return the drawing without its last place."""
        return self._replace(points=self.points[:-1])


def source_of(drawing: Drawing, frame: Frame, name: str, rocks: int, above_ground: float) -> dict[str, Any]:
    """Return the drawn source as keys and values for a scene file, in the coordinates of the input.

    rocks : number of rocks; above_ground : height of the release above the ground (m)

    Raises
    ------
    InputError
        Too few places were clicked.
    """
    _check(drawing, "source")
    places = _rounded(frame.points_to_input(np.array(drawing.points)))
    return {"name": name, drawing.kind: places, "above_ground": above_ground, "rocks": rocks}


def area_of(drawing: Drawing, frame: Frame, name: str) -> dict[str, Any]:
    """Return the drawn area of interest as keys and values for a scene file, in plan coordinates of the input.

    Raises
    ------
    InputError
        Fewer than three places were clicked, or the outline crosses itself.
    """
    _check(drawing, "area")
    points = frame.points_to_input(np.array(drawing.points))
    corners = _rounded(points[:, [0, 1] if frame.up == "z" else [0, 2]])
    try:
        polygon_of([(x, y) for x, y in corners])
    except InputError as fault:
        raise InputError(f"the area {name!r} {fault}") from fault
    return {"name": name, "polygons": corners}


def _check(drawing: Drawing, noun: str) -> None:
    least = LEAST.get(drawing.kind, 1)
    if len(drawing.points) < least:
        points = "1 point" if least == 1 else f"{least} points"
        raise InputError(f"the {noun} has too few points; click at least {points} on the terrain")


def _rounded(points: FloatArray) -> list[Sequence[float]]:
    found: list[Sequence[float]] = np.round(points, DECIMALS).tolist()
    return found
