"""Trajectories, hazard zones and areas of interest -> visualization_msgs/MarkerArray; `marker_reading` reads them.

Every array begins with DELETEALL, so that nothing of an earlier event stays on the screen. What is sent is laid out as
bytes (`marker_layout`): a burst of sources must be answered faster than Python makes as many objects.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.ensemble.paths import run_starts
from rpf3d_core.live.zones import ShownZone
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.columns import Columns
from rpf3d_ros.messages.marker_layout import CLEARING, WHITE, Layout, cdr_of_markers
from rpf3d_ros.messages.marker_reading import AREAS, HAZARD

TRAJECTORIES = "trajectories"
"""Namespace of all trajectories (id = rock); each hazard level and each area of interest has one of its own."""

FACETS, OUTLINE = 0, 1
"""Ids of the two markers of a hazard level."""

LINE_WIDTH = 0.3
"""Width of a line on the screen (m): visible on a pit of 1 km, thinner than its rocks."""

AREA_WIDTH, AREA_COLOUR = 1.0, (0.9, 0.24, 0.78, 1.0)
"""Of the outline of an area of interest: width (m); red, green, blue, opacity."""

LEAST, GREATEST = np.array([1.0, 0.85, 0.2, 0.45]), np.array([0.8, 0.05, 0.1, 0.75])
"""Red, green, blue, opacity of the facets of the first hazard level and of the last; those between lie between."""


def trajectory_markers(header: Header, columns: Columns, most: int, points_each: int, result: int = 0) -> bytes:
    """The CDR bytes of a LINE_STRIP a rock, coloured by speed, of at most `most` rocks and `points_each` points.

    More are thinned evenly, ends are kept; trajectories/points carries all of them. Each says `result N`.
    """
    strips = _thinned(columns["rock"], most, points_each)
    rows = np.concatenate([np.empty(0, dtype=np.int64), *strips])
    points = np.stack([columns[name][rows] for name in "xyz"], axis=-1)
    colours = _colours(columns["speed"][rows], float(np.max(columns["speed"], initial=0.0)))
    ends = np.cumsum([len(strip) for strip in strips])
    scale, text = (LINE_WIDTH, 0.0, 0.0), text_of(result)
    markers = [CLEARING]
    for strip, end in zip(strips, ends, strict=True):
        rock, some = int(columns["rock"][strip[0]]), slice(end - len(strip), end)
        markers.append(
            Layout(TRAJECTORIES, rock, Marker.LINE_STRIP, Marker.ADD, scale, WHITE, points[some], colours[some], text)
        )
    return cdr_of_markers(header, markers)


def zone_markers(header: Header, zones: Iterable[ShownZone], result: int = 0) -> bytes:
    """The CDR bytes of a TRIANGLE_LIST and a LINE_LIST a zone, in namespace hazard/<name>; each says `result N`.

    A zone without facets, or without an outline, has no such marker: RViz refuses one without points.
    """
    zones, text = list(zones), text_of(result)
    markers = [CLEARING]
    for rank, zone in enumerate(zones):
        share = rank / max(len(zones) - 1, 1)
        r, g, b, a = ((1.0 - share) * LEAST + share * GREATEST).tolist()
        namespace, facets, edges = HAZARD + zone.name, zone.corners.reshape(-1, 3), zone.outline.reshape(-1, 3)
        drawn = (
            Layout(namespace, FACETS, Marker.TRIANGLE_LIST, Marker.ADD, (1.0, 1.0, 1.0), (r, g, b, a), facets),
            Layout(namespace, OUTLINE, Marker.LINE_LIST, Marker.ADD, (LINE_WIDTH, 0.0, 0.0), (r, g, b, 1.0), edges),
        )
        markers += [marker._replace(text=text) for marker in drawn if len(marker.points)]
    return cdr_of_markers(header, markers)


def area_markers(header: Header, areas: Mapping[str, Sequence[FloatArray]], result: int = 0) -> bytes:
    """The CDR bytes of a LINE_STRIP a ring, lines (T, 3) m, in namespace areas/<name>; each says `result N`."""
    scale, text = (AREA_WIDTH, 0.0, 0.0), text_of(result)
    markers = [CLEARING]
    for name, rings in areas.items():
        for number, ring in enumerate(rings):
            markers.append(
                Layout(AREAS + name, number, Marker.LINE_STRIP, Marker.ADD, scale, AREA_COLOUR, ring, text=text)
            )
    return cdr_of_markers(header, markers)


def text_of(result: int) -> str:
    """What a marker says of the result that it belongs to."""
    return f"result {result}"


def _thinned(rock: NDArray[Any], most: int, points_each: int) -> list[NDArray[np.int64]]:
    """Rows of at most so many rocks, at most so many each, of the points (N,) of rocks, which lie rock by rock."""
    if len(rock) == 0:
        return []
    first = run_starts(rock)
    last = np.append(first[1:], len(rock))
    return [first[k] + evenly(last[k] - first[k], points_each) for k in evenly(len(first), most)]


def evenly(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` (>= 2) of the indices 0 .. count - 1, evenly spread, with the first and the last."""
    if count <= most:
        return np.arange(count)
    return np.linspace(0, count - 1, most).round().astype(np.int64)


def _colours(speed: FloatArray, fastest: float) -> NDArray[np.float32]:
    """Colours (N, 4) by speed, as shares; fastest : of all rocks (m/s)."""
    shown = speed_colours(speed, fastest) / np.float32(255.0)
    return np.concatenate([shown, np.ones((len(shown), 1))], axis=1).astype(np.float32)
