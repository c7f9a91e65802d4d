"""How the viewer lays a recording out: 3D on the left, series, log and document on the right."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.recordings.hazard import BENCHES, ENERGY, REACH
from rpf3d_core.terrain.facets import Terrain

TIMELINE = "sim_time"

COVERING = ("world/trajectories", "world/ends")
"""Entities that would cover the hazard: hidden in its views."""
LAYERS = {REACH: "Reach probability", ENERGY: "Energy, p95"}
"""Entities of hazard, and the titles of their views."""

EYE_DISTANCE, EYE_HEIGHT = 1.1, 0.7
"""Of the eye from what it looks at, over the extent of the paths (-): all paths in view, seen from where rocks go."""

HEADROOM = 1.05
"""Top of a series' axis over its largest value (-)."""


def blueprint(terrain: Terrain, samples: PathSamples, fastest: float, most_energy: float, hazard: bool = False) -> Any:
    """The layout, with the eye in front of the wall that the sampled rocks come down.

    `fastest` (m/s) and `most_energy` (J) are the largest values of the series; with `hazard` there is a view for each
    of its layers, and a page for the bench table.
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
    """The paths, and a view for each layer of hazard; what a view hides can be shown there, and the other way round."""
    import rerun.blueprint as rrb

    return rrb.Tabs(
        _view(name, eye, hidden=LAYERS),
        *(_view(title, eye, hidden=(*COVERING, *(other for other in LAYERS if other != layer)))
          for layer, title in LAYERS.items()),
    )  # fmt: skip


def _view(name: str, eye: tuple[FloatArray, FloatArray], hidden: Iterable[str] = ()) -> Any:
    """The world in 3D from an eye, some entities hidden."""
    import rerun.blueprint as rrb

    target, position = eye
    controls = rrb.EyeControls3D(position=position, look_target=target, eye_up=(0.0, 0.0, 1.0))
    overrides: dict[Any, Any] = {entity: rrb.EntityBehavior(visible=False) for entity in hidden}
    return rrb.Spatial3DView(origin="world", name=name, eye_controls=controls, line_grid=False, overrides=overrides)


def _series(origin: str, name: str, largest: float) -> Any:
    """A view of series from 0 to their largest value; a legend of 20 rocks would cover it."""
    import rerun.blueprint as rrb

    axis = rrb.ScalarAxis(range=(0.0, HEADROOM * largest)) if largest > 0.0 else None
    return rrb.TimeSeriesView(origin=origin, name=name, axis_y=axis, plot_legend=rrb.PlotLegend(visible=False))


def point_of_view(terrain: Terrain, samples: PathSamples) -> tuple[FloatArray, FloatArray]:
    """What to look at and from where, (3,) m each: the middle of the paths, from ahead of the rocks and above.

    Without paths, the terrain from the south.
    """
    points = samples.x if len(samples.x) else terrain.vertices
    low, high = points.min(axis=0), points.max(axis=0)
    extent = max(float(np.linalg.norm(high - low)), 1.0)
    ahead = _ahead(samples)
    target = (low + high) / 2
    return target, target + extent * np.array([EYE_DISTANCE * ahead[0], EYE_DISTANCE * ahead[1], EYE_HEIGHT])


def _ahead(samples: PathSamples) -> FloatArray:
    """Unit direction (2,) in plan in which the rocks travel on average."""
    south = np.array([0.0, -1.0])
    if len(samples.x) == 0:
        return south
    starts = samples.starts
    ends = np.append(starts[1:], len(samples.row)) - 1
    travel = (samples.x[ends] - samples.x[starts])[:, :2].mean(axis=0)
    length = float(np.linalg.norm(travel))
    return np.asarray(travel / length) if length > 0.0 else south
