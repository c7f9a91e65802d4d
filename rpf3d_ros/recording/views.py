"""The viewer's layout for a recording of the live nodes: 3D and plan, alert levels, energies, logs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.recordings.blueprint import point_of_view
from rpf3d_core.recordings.log import import_rerun
from rpf3d_core.terrain.facets import Terrain
from rpf3d_ros.messages.alert_reading import LEVELS
from rpf3d_ros.messages.marker_reading import Strip

STATE_COLOURS = {
    "normal": 0x4C9F50FF,
    "watch": 0xE0C030FF,
    "restrict": 0xE08A20FF,
    "evacuate": 0xC02020FF,
    "fault": 0x8040A0FF,
    "off": 0x4C9F50FF,
    "on": 0xC02020FF,
}
"""Colour of each alert level and of the alarm: red, green, blue, opacity."""

NOWHERE = Terrain(
    vertices=np.zeros((0, 3)), triangles=np.zeros((0, 3), dtype=np.int32), zone=np.zeros(0, dtype=np.int32), zones=()
)
"""Empty terrain for `point_of_view`, so that the place of the viewer's eye depends on the trajectories only."""

COVERING = ("trajectories/points", "hazard/points")
"""Parts of the recording that are hidden at first, because they would cover other parts."""


BEFORE, AFTER = -300.0, 150.0
"""Range of the plots around the current moment (s)."""


def blueprint(strips: Sequence[Strip] = ()) -> Any:
    """Return the viewer's layout.

    strips : trajectories that the viewer's eye shows from the front; if empty, the viewer chooses the place of the eye
    """
    rrb = import_rerun().blueprint
    around = _around()
    series = (
        rrb.TimeSeriesView(
            origin="alert_level",
            name=f"Alert level: {', '.join(f'{i} {level}' for i, level in enumerate(LEVELS))}",
            axis_x=around,
            axis_y=rrb.ScalarAxis(range=(-0.25, len(LEVELS) - 0.75), zoom_lock=True),
            plot_legend=rrb.PlotLegend(visible=False),
        ),
        rrb.StateTimelineView(origin="alert_state", name="Alert by area", time_view=around),
        rrb.TimeSeriesView(origin="energy", name="Energy at impacts (kJ)", axis_x=around),
    )
    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    texts = rrb.Tabs(
        *(
            rrb.TextLogView(origin=name.lower(), name=name, columns=columns)
            for name in ("Alerts", "Diagnostics", "Results")
        ),
        rrb.TextDocumentView(origin="about", name="About"),
    )
    panels = (
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="ros_time", play_state="following"),
    )
    right = rrb.Vertical(*series, texts, row_shares=[2, 2, 2, 3])
    return rrb.Blueprint(rrb.Horizontal(_places(strips), right, column_shares=[3, 2]), *panels)


def _around() -> Any:
    """Return the time axis of the plots, which moves with the current moment."""
    rerun = import_rerun()
    boundary = rerun.blueprint.TimeRangeBoundary.cursor_relative
    return rerun.blueprint.TimeAxis(
        view_range=rerun.TimeRange(start=boundary(seconds=BEFORE), end=boundary(seconds=AFTER))
    )


def extent_of(strips: Sequence[Strip]) -> float:
    """Return the extent of trajectories: the diagonal (m) of their box; 0 without points."""
    points = np.concatenate([np.empty((0, 3)), *(strip.points for strip in strips)])
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _places(strips: Sequence[Strip]) -> Any:
    """Return the views of the terrain in 3D and of the map of reach probability in plan."""
    rrb = import_rerun().blueprint
    eye = None
    if strips:
        target, position = point_of_view(NOWHERE, _as_samples(strips))
        eye = rrb.EyeControls3D(position=position, look_target=target, eye_up=(0.0, 0.0, 1.0))
    world = rrb.Spatial3DView(
        origin="/",
        contents=["$origin/**", "- /plan/**"],
        name="Map frame",
        eye_controls=eye,
        line_grid=False,
        overrides={entity: rrb.EntityBehavior(visible=False) for entity in COVERING},
    )
    return rrb.Tabs(world, rrb.Spatial2DView(origin="plan", name="Reach probability, north up"))


def _as_samples(strips: Sequence[Strip]) -> PathSamples:
    """Return the points of trajectories as samples of paths, for `point_of_view`.

    Times and velocities are unknown and set to zero.
    """
    x = np.concatenate([strip.points for strip in strips])
    row = np.repeat(np.arange(len(strips)), [len(strip.points) for strip in strips])
    return PathSamples(row=row, t=np.zeros(len(x)), x=x, v=np.zeros_like(x), mode=np.zeros(len(x), dtype=np.int64))
