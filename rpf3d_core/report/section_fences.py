"""Find where the barriers of a scene cross the critical section, to draw the barriers in the picture of the section."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import local_plan
from rpf3d_core.formats.polylines import lines_along
from rpf3d_core.report.footing import Footing, footing_at
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.section import CriticalSection
from rpf3d_core.terrain.draped_outlines import draped_lines
from rpf3d_core.terrain.frame import FloatArray


class FenceInSection(NamedTuple):
    """The crossing of a barrier with a section: distance (m) along the section, elevations (m) of foot and top."""

    name: str
    distance: float
    foot: float
    top: float


def fences_in(run: RunFiles, section: CriticalSection) -> tuple[list[FenceInSection], list[str]]:
    """Return the crossings of a scene's barriers with a section, and the names of all other barriers.

    The other barriers do not cross the section, or the file of their line cannot be read.
    """
    panels = panels_of(run)
    found = [fence for panel in panels for fence in _crossings(run, section, panel)]
    crossing = {fence.name for fence in found}
    return found, [panel["name"] for panel in panels if panel["name"] not in crossing]


def footings_of_barriers(run: RunFiles) -> dict[str, Footing]:
    """Return the slope of the ground along the line of each barrier of a scene, by name of the barrier.

    The slope is measured at a point about every metre of the line. Barriers whose file cannot be read are left out.
    """
    lines = {panel["name"]: barrier_lines(run, panel) for panel in panels_of(run)}
    return {name: footing_at(run.terrain, _places_on(run, each)) for name, each in lines.items() if each}


def _places_on(run: RunFiles, lines: list[FloatArray]) -> FloatArray:
    """Return places (N, 2) m in plan along lines (P, 2) m, only where the lines lie on the terrain."""
    return np.concatenate([np.empty((0, 2)), *(line[:, :2] for line in draped_lines(run.terrain, lines))])


def panels_of(run: RunFiles) -> list[dict[str, Any]]:
    """Return the values of each barrier of a run's scene (name, height, ...), from summary.json; [] without barriers.

    summary.json states the full paths of the files with barrier lines; inputs.json states only the names of the files.
    """
    barriers = run.summary["scene"]["effects"].get("barriers") or {}
    return list(barriers.get("panels", ()))


def height_of(panel: dict[str, Any]) -> float:
    """Return the height (m) of the part of a barrier that still stands; panel : values of the barrier."""
    return float(panel["height"]) * float(panel.get("residual_height", 1.0))


def _crossings(run: RunFiles, section: CriticalSection, panel: dict[str, Any]) -> Iterator[FenceInSection]:
    """Yield the crossings of a barrier with the profile of a section, except crossings at places without ground.

    panel : values of the barrier, from `panels_of`
    """
    east, north, _ = run.terrain.frame.origin
    azimuth = np.radians(section.azimuth)
    start, along = section.start - (east, north), np.array([np.sin(azimuth), np.cos(azimuth)])
    for line in barrier_lines(run, panel):
        for distance in _distances(line - start, along):
            if section.distance[0] <= distance <= section.distance[-1]:
                foot = float(np.interp(distance, section.distance, section.ground))
                if np.isfinite(foot):
                    yield FenceInSection(
                        name=panel["name"], distance=distance, foot=foot, top=foot + height_of(panel)
                    )


def barrier_lines(run: RunFiles, panel: dict[str, Any]) -> list[FloatArray]:
    """Return the lines of a barrier, each (P, 2) m in the local frame; [] if `lines_along` refuses them.

    panel : values of the barrier, from `panels_of`
    """
    along = panel["along"]
    try:
        lines = lines_along(Path(along) if isinstance(along, str) else tuple(map(tuple, along)))
    except InputError:
        return []
    return [local_plan(run.terrain.frame, line) for line in lines]


def _distances(line: FloatArray, along: FloatArray) -> list[float]:
    """Return the distances (m) along an axis at which a line crosses the axis; negative behind the axis' origin.

    line : (P, 2) m, relative to the origin of the axis; along : (2,) unit vector of the axis
    """
    ahead, across = line @ along, line @ np.array([-along[1], along[0]])
    crossed = np.flatnonzero((across[:-1] < 0.0) != (across[1:] < 0.0))
    share = across[crossed] / (across[crossed] - across[crossed + 1])
    found: list[float] = (ahead[crossed] + share * (ahead[crossed + 1] - ahead[crossed])).tolist()
    return found
