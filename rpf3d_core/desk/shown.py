"""Show the scene and the last results in the view of the desk."""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.desk.clicks import Drawing
from rpf3d_core.desk.shapes import (
    ENERGY,
    NO_LINES,
    REACH,
    DrapedMap,
    Lines,
    area_lines,
    barrier_mesh,
    downhill,
    ground_mesh,
    ground_seen,
    hazard_map,
    lifted,
    marks_raised,
    path_lines,
    release_lines,
)
from rpf3d_core.desk.window import AREAS, BARRIERS, CRESTS, DRAWN, GROUND, MAP, PATHS, RELEASES, THIN, VtkWindow
from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.hazard.scales import FEW_WORDS
from rpf3d_core.report.view import ABOVE_MAPS, Seen
from rpf3d_core.results.findings import Run
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray

LEAST_SEEN = 60.0
"""Smallest extent (m) of the region around the sources that the camera shows."""


class RunShown(NamedTuple):
    """The results in the view: paths, and the hazard maps by kind (REACH, ENERGY)."""

    paths: Lines
    maps: dict[str, DrapedMap]


NO_RUN = RunShown(paths=NO_LINES, maps={})


class SceneView:
    """The view of the desk: a window with the scene and its results; only the server's thread may change it."""

    def __init__(self) -> None:
        """Make an empty window."""
        self.window = VtkWindow()
        self.terrain: Terrain | None = None
        self._seen: Seen | None = None
        self._releases: FloatArray = np.empty((0, 3))
        self._areas = NO_LINES
        self._run = NO_RUN

    def show_scene(self, prepared: Prepared) -> bool:
        """Show terrain, sources, barriers and areas of a scene; return True if the terrain has changed."""
        new = self._seen is None or self.terrain is not prepared.terrain
        if self._seen is None or new:
            self.terrain, self._seen = prepared.terrain, ground_seen(prepared.terrain)
            self.window.show_mesh(GROUND, ground_mesh(self._seen))
        self._releases, lines = release_lines(prepared.sources, self._seen)
        self.window.show_points(RELEASES, self._releases)
        self.window.show_lines(CRESTS, lines)
        self.window.show_mesh(BARRIERS, barrier_mesh(prepared.obstacles))
        self._areas = area_lines(self._seen, prepared.outlines)
        self.show_run(NO_RUN)
        self.drape("")
        if new:
            self.look("sources")
        return new

    def laid_out(self, run: Run) -> RunShown:
        """Return the paths and hazard maps of the results so far, as `show_run` needs them; callable on any thread."""
        if self._seen is None:
            return NO_RUN
        maps = {kind: hazard_map(self._seen, run.maps, kind) for kind in (REACH, ENERGY)}
        return RunShown(paths=path_lines(run), maps=maps)

    def show_run(self, run: RunShown) -> None:
        """Show the paths of the rocks, and keep the hazard maps, so that `drape` can show one of the maps."""
        self._run = run
        self.window.show_lines(PATHS, run.paths, THIN)

    def drape(self, kind: str) -> dict[str, Any]:
        """Show a hazard map of the results over the terrain, and return its legend, or {} if there is no such map.

        The keys of the legend are `title`, `unit`, `largest` (the largest value, as text), `few` (words for the ground
        that too few rocks for a value reached; "" without such ground) and `caption`.

        kind : REACH, ENERGY, or "" to show no map
        """
        found = self._run.maps.get(kind)
        self.window.show_mesh(MAP, None if found is None else found.mesh)
        self._show_areas(0.0 if found is None else found.raised)
        if found is None:
            return {}
        empty = "" if found.largest > 0.0 else ": no values yet"
        return {
            "title": found.title + empty, "unit": found.unit, "largest": three_figures(found.largest),
            "few": FEW_WORDS if found.has_few else "", "caption": found.caption,
        }  # fmt: skip

    def _show_areas(self, map_raised: float) -> None:
        """Show the outlines of areas above the ground and the map.

        map_raised : distance (m) of the map from the ground, 0 without a map
        """
        if self._seen is not None:
            height = max(marks_raised(self._seen), ABOVE_MAPS * map_raised)
            self.window.show_lines(AREAS, lifted(self._areas, height))

    def show_drawing(self, drawing: Drawing) -> None:
        """Show the places that the user has clicked."""
        self.window.show_points(DRAWN, np.array(drawing.points).reshape(-1, 3))

    def look(self, where: str) -> None:
        """Turn the camera to the sources, or to the whole terrain; do nothing if no terrain is shown.

        where : "sources" or "all"; without release points, the camera turns to the whole terrain
        """
        if self.terrain is None or self._seen is None:
            return
        if where == "sources" and len(self._releases):
            middle = self._releases.mean(axis=0)
            extent = float(np.ptp(self._releases, axis=0).max())
            half = 0.5 * min(max(LEAST_SEEN, 2.0 * extent), float(np.ptp(self.terrain.vertices, axis=0).max()))
            side = downhill(self._seen, self._releases)
            middle = middle + 0.5 * half * np.array([*side, -1.0])  # else rocks would fall out of the view
            self.window.look_at(np.stack([middle - half, middle + half]), side)
        else:
            self.window.look_at(self.terrain.vertices)
