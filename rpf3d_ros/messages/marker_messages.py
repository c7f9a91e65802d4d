"""Convert trajectories, hazard zones and areas of interest to a MarkerArray; `marker_reading` does the reverse.

Every array begins with DELETEALL, so that no marker of an earlier event stays on the screen. The messages are laid out
as bytes (`marker_layout`), because Python objects would take too long for the answer to a burst of sources.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.ensemble.paths import evenly, run_starts
from rpf3d_core.live.zones import ShownZone
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.answer_content import Columns
from rpf3d_ros.messages.marker_layout import CLEARING, WHITE, Layout, cdr_of_markers
from rpf3d_ros.messages.marker_reading import AREAS, HAZARD

TRAJECTORIES = "trajectories"
"""Namespace of all trajectory markers, whose ids are numbers of rocks; each zone and area has another namespace."""

FACETS, OUTLINE = 0, 1
"""Ids of the two markers of a hazard zone: its facets and its outline."""

LINE_WIDTH = 0.3
"""Width (m) of drawn trajectories and outlines of zones: visible in a pit of 1 km, but thinner than rocks."""

AREA_WIDTH, AREA_COLOUR = 1.0, (0.9, 0.24, 0.78, 1.0)
"""Outline of an area of interest: its width (m), and its colour as red, green, blue, opacity, 0 to 1."""

LEAST, GREATEST = np.array([1.0, 0.85, 0.2, 0.45]), np.array([0.8, 0.05, 0.1, 0.75])
"""Red, green, blue and opacity (0 to 1) of the facets of the lowest and the highest hazard zone.

The colours of the zones in between are interpolated.
"""


def trajectory_markers(header: Header, columns: Columns, most: int, points_each: int, result: int = 0) -> bytes:
    """Return the trajectories as a marker message (CDR bytes): one line for each rock, coloured by speed.

    The array has at most `most` rocks and `points_each` points for each rock. If there are more, rocks and points are
    thinned evenly, and the first and last points stay; the topic trajectories/points has all points.

    columns : as `AnswerContent.trajectories`; result : number of the result, in the text of each marker: `result N`
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
            Layout(
                namespace=TRAJECTORIES,
                number=rock,
                kind=Marker.LINE_STRIP,
                scale=scale,
                colour=WHITE,
                points=points[some],
                colours=colours[some],
                text=text,
            )
        )
    return cdr_of_markers(header, markers)


def zone_markers(header: Header, zones: Iterable[ShownZone], result: int = 0) -> bytes:
    """Return the hazard zones as a marker message (CDR bytes): facets and outline of each zone.

    The namespace of a zone is hazard/<name>. The text of each marker is `result N`. A zone without facets has no
    marker of facets, and a zone without an outline has no marker of an outline: RViz refuses a marker without points.
    """
    zones, text = list(zones), text_of(result)
    markers = [CLEARING]
    for rank, zone in enumerate(zones):
        share = rank / max(len(zones) - 1, 1)
        r, g, b, a = ((1.0 - share) * LEAST + share * GREATEST).tolist()
        namespace, facets, edges = HAZARD + zone.name, zone.corners.reshape(-1, 3), zone.outline.reshape(-1, 3)
        drawn = (
            Layout(
                namespace=namespace,
                number=FACETS,
                kind=Marker.TRIANGLE_LIST,
                scale=(1.0, 1.0, 1.0),
                colour=(r, g, b, a),
                points=facets,
            ),
            Layout(
                namespace=namespace,
                number=OUTLINE,
                kind=Marker.LINE_LIST,
                scale=(LINE_WIDTH, 0.0, 0.0),
                colour=(r, g, b, 1.0),
                points=edges,
            ),
        )
        markers += [marker._replace(text=text) for marker in drawn if len(marker.points)]
    return cdr_of_markers(header, markers)


def area_markers(header: Header, areas: Mapping[str, Sequence[FloatArray]], result: int = 0) -> bytes:
    """Return the outlines of areas of interest as a marker message (CDR bytes).

    areas : name -> outlines, each of T points (T, 3) m; the namespace of an area is areas/<name>
    result : number of the result, in the text of each marker: `result N`
    """
    scale, text = (AREA_WIDTH, 0.0, 0.0), text_of(result)
    markers = [CLEARING]
    for name, rings in areas.items():
        for number, ring in enumerate(rings):
            markers.append(
                Layout(
                    namespace=AREAS + name,
                    number=number,
                    kind=Marker.LINE_STRIP,
                    scale=scale,
                    colour=AREA_COLOUR,
                    points=ring,
                    text=text,
                )
            )
    return cdr_of_markers(header, markers)


def text_of(result: int) -> str:
    """Return the text of a marker, `result N`; result : number of the result that the marker belongs to."""
    return f"result {result}"


def _thinned(rock: NDArray[Any], most: int, points_each: int) -> list[NDArray[np.int64]]:
    """Return the rows of the points to draw, thinned evenly if there are too many: one array for each drawn rock.

    rock : (N,) rock of each point, grouped by rock
    most : largest number of rocks; points_each : largest number of points for each rock
    """
    if len(rock) == 0:
        return []
    first = run_starts(rock)
    last = np.append(first[1:], len(rock))
    return [first[k] + evenly(last[k] - first[k], points_each) for k in evenly(len(first), most)]


def _colours(speed: FloatArray, fastest: float) -> NDArray[np.float32]:
    """Return colours (N, 4) by speed: red, green, blue, opacity, 0 to 1.

    speed : (N,) m/s; fastest : greatest speed of all rocks (m/s)
    """
    shown = speed_colours(speed, fastest) / np.float32(255.0)
    return np.concatenate([shown, np.ones((len(shown), 1))], axis=1).astype(np.float32)
