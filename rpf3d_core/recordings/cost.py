"""Write a scene's price list (error and computing time of each setting) as a recording (.rrd) for the viewer."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.recordings.log import APPLICATION, begin_recording, end_recording, import_rerun
from rpf3d_core.results.series import Series

LINE, POINT = 1.5, 4.0
"""Radii of lines and points in the viewer (pixels): half of their widths."""


def write_cost_recording(path: Path, series: Sequence[Series], picture: Path, document: str) -> None:
    """Write the recording of `rpf3d cost`: points of error against computing time, a picture and a document.

    The points are at (log10 seconds, -log10 error).

    path : of the recording; series : the price list, a line of points for each series; picture : path of cost.png
    document : text of the document, in Markdown

    Raises
    ------
    InputError
        rerun is not installed.
    OSError
        The file could not be written.
    """
    rr = import_rerun()
    recording, stream = begin_recording(f"{APPLICATION}_cost", _layout())
    for one in series:
        _log_series(recording, one)
    recording.log("picture", rr.EncodedImage(path=picture), static=True)
    recording.log("document", rr.TextDocument(document, media_type=rr.MediaType.MARKDOWN), static=True)
    end_recording(recording, stream, path)


def _log_series(recording: Any, one: Series) -> None:
    """Write one series of the price list (error against computing time) as a line with labelled points."""
    rr = import_rerun()
    places = places_of(one)
    line, dots = (rr.new_entity_path(["cost", one.name, part]) for part in ("line", "points"))
    recording.log(line, rr.LineStrips2D([places], colors=[one.colour], radii=[-LINE]), static=True)
    labels = [f"{one.name}: {word}" for word in one.words]
    points = rr.Points2D(places, colors=[one.colour], radii=[-POINT], labels=labels, show_labels=False)
    recording.log(dots, points, static=True)


def places_of(one: Series) -> FloatArray:
    """Return the positions (S, 2) of a series' points in the viewer: log10 of the seconds, -log10 of the errors (-).

    The viewer's y axis points down, so the minus sign puts smaller errors lower.
    """
    return np.stack([np.log10(one.seconds), -np.log10(one.errors)], axis=1)


def _layout() -> Any:
    """Return the layout of the price list in the viewer: picture and series on the left, document on the right."""
    import rerun.blueprint as rrb

    views = rrb.Tabs(
        rrb.Spatial2DView(origin="picture", name="What accuracy costs"),
        rrb.Spatial2DView(origin="cost", name="log10 seconds to the right, small errors lower; hover for the setting"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(views, rrb.TextDocumentView(origin="document", name="Price list"), column_shares=[3, 2]),
        collapse_panels=True,
    )
