"""Arrange the views of a recording in the viewer: 3D views on the left; plots, log and document on the right."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.recordings.hazard import BENCHES, ENERGY, REACH
from rpf3d_core.terrain.facets import Terrain

TIMELINE = "sim_time"

COVERING = ("world/trajectories", "world/ends")
"""Entities that are hidden in the views of the hazard maps, because paths and end points would cover the maps."""
LAYERS = {REACH: "Reach probability", ENERGY: "Energy, p95"}
"""Title of the view of each hazard map, by the name of the map's entity in the recording."""

EYE_DISTANCE, EYE_HEIGHT = 1.1, 0.7
"""Horizontal distance and height of the viewer's eye from its target (-), as shares of the extent of the paths.

From there, all paths are in view, seen from the side towards which the rocks travel.
"""

HEADROOM = 1.05
"""Ratio (-) of the top of a plot's axis to the largest value, so that the line does not touch the frame."""


def blueprint(terrain: Terrain, samples: PathSamples, fastest: float, most_energy: float, hazard: bool = False) -> Any:
    """Return the layout of a run's recording in the viewer; the eye of the 3D views is ahead of the rocks and above.

    samples : points along the paths of the recording; fastest, most_energy : largest speed (m/s) and energy (J) in the
        plots
    hazard : True to add a view for each hazard layer, and a page for the bench table
    """
    import rerun.blueprint as rrb

    east, north, up = terrain.frame.origin
    name = f"Terrain by zone, paths by speed; local frame, origin ({east:.10g}, {north:.10g}, {up:.10g})"
    eye = point_of_view(terrain, samples)
    views = _hazard_views(name, eye) if hazard else _view(name, eye)
    pages = [rrb.TextDocumentView(origin=BENCHES, name="Benches")] if hazard else []
    series = [_series("speed", "Speed (m/s)", fastest), _series("energy", "Kinetic energy (J)", most_energy)]
    texts = rrb.Tabs(
        rrb.TextLogView(origin="log", name="Log"),
        *pages,
        rrb.TextDocumentView(origin="document", name="Scene and summary"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(views, rrb.Vertical(*series, texts, row_shares=[2, 2, 3]), column_shares=[3, 2]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
    )


def _hazard_views(name: str, eye: tuple[FloatArray, FloatArray]) -> Any:
    """Return the 3D views as tabs: a view of the paths, and a view of each hazard map.

    Each view hides the parts that would cover its content; users can show them again.

    name : title of the view of the paths; eye : target and position of the viewer's eye, (3,) m each
    """
    import rerun.blueprint as rrb

    return rrb.Tabs(
        _view(name, eye, hidden=LAYERS),
        *(_view(title, eye, hidden=(*COVERING, *(other for other in LAYERS if other != layer)))
          for layer, title in LAYERS.items()),
    )  # fmt: skip


def _view(name: str, eye: tuple[FloatArray, FloatArray], hidden: Iterable[str] = ()) -> Any:
    """Return a 3D view of the recording.

    eye : target and position, (3,) m each; hidden : paths of the entities that are not shown at first
    """
    import rerun.blueprint as rrb

    target, position = eye
    controls = rrb.EyeControls3D(position=position, look_target=target, eye_up=(0.0, 0.0, 1.0))
    overrides: dict[Any, Any] = {entity: rrb.EntityBehavior(visible=False) for entity in hidden}
    return rrb.Spatial3DView(origin="world", name=name, eye_controls=controls, line_grid=False, overrides=overrides)


def _series(origin: str, name: str, largest: float) -> Any:
    """Return a view that plots one quantity of several rocks over time.

    The view has no legend, because 20 names would cover the lines.

    origin : path of the entities with the quantity; name : title; largest : end of the value axis, which begins at 0
    """
    import rerun.blueprint as rrb

    axis = rrb.ScalarAxis(range=(0.0, HEADROOM * largest)) if largest > 0.0 else None
    return rrb.TimeSeriesView(origin=origin, name=name, axis_y=axis, plot_legend=rrb.PlotLegend(visible=False))


def point_of_view(terrain: Terrain, samples: PathSamples) -> tuple[FloatArray, FloatArray]:
    """Return the target and the position of the eye of the 3D views, (3,) m each, local frame.

    The target is the middle of the paths; the eye is ahead of the rocks and above. Without paths, the eye looks at the
    terrain from the south.
    """
    points = samples.x if len(samples.x) else terrain.vertices
    low, high = points.min(axis=0), points.max(axis=0)
    extent = max(float(np.linalg.norm(high - low)), 1.0)
    ahead = _ahead(samples)
    target = (low + high) / 2
    return target, target + extent * np.array([EYE_DISTANCE * ahead[0], EYE_DISTANCE * ahead[1], EYE_HEIGHT])


def _ahead(samples: PathSamples) -> FloatArray:
    """Return the unit vector (2,) of the rocks' mean travel in plan; south if there are no paths or the mean is 0."""
    south = np.array([0.0, -1.0])
    if len(samples.x) == 0:
        return south
    starts = samples.starts
    ends = np.append(starts[1:], len(samples.row)) - 1
    travel = (samples.x[ends] - samples.x[starts])[:, :2].mean(axis=0)
    length = float(np.linalg.norm(travel))
    return np.asarray(travel / length) if length > 0.0 else south
