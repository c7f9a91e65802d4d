"""Compute the arrays that the view of the desk draws: terrain, paths, hazard maps, releases and outlines."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.accuracy.decimated import decimated_mesh
from rpf3d_core.ensemble.fly import spread_over
from rpf3d_core.ensemble.paths import displayed_rows, sample_paths
from rpf3d_core.ensemble.releases import Source
from rpf3d_core.hazard.maps import FEWEST_ROCKS, HazardMaps, reach_probability
from rpf3d_core.hazard.scales import FEW_COLOUR
from rpf3d_core.report.draped_map import FEW, caption_of
from rpf3d_core.report.run_files import HazardGrid
from rpf3d_core.report.view import (
    LIGHT,
    MOST_TRIANGLES,
    UPPER_REACH,
    WORST_ENERGY,
    WORST_REACH,
    Seen,
    draped,
    raised_by,
)
from rpf3d_core.results.findings import Run
from rpf3d_core.terrain.draped_outlines import MARGIN, draped_outlines
from rpf3d_core.terrain.facets import Terrain, unit_normals
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import height_image, heights_at
from rpf3d_core.terrain.obstacles import Obstacles

REACH, ENERGY = "reach", "energy"
"""The two hazard maps that can be draped over the terrain: reach probability (%) and p95 energy (kJ)."""
DARK, LIGHT_COLOUR = np.array([62.0, 55.0, 44.0]), np.array([226.0, 219.0, 203.0])
"""Colours (red, green, blue) of ground in the shade and in the light."""
RAMP = np.array([[255, 255, 178], [254, 204, 92], [253, 141, 60], [240, 59, 32], [189, 0, 38]], dtype=float)
"""Colours of a hazard map from 0 to its largest value: YlOrRd of ColorBrewer."""

BARRIER_COLOUR = np.array([0, 133, 119], dtype=np.uint8)
"""Colour (red, green, blue) of the panels of barriers."""
NEARBY = 100.0
"""Smallest distance (m) around sources in which lower ground is searched."""
MARKS_RAISED = 0.001
"""Height of marks above the terrain, as a share (-) of the terrain's extent."""
MOST_MARKS = 500
"""Largest number of release points that are marked."""

Colours = NDArray[np.uint8]


class DrawnMesh(NamedTuple):
    """Triangles to draw; vertices : (V, 3) m, local frame; triangles : (F, 3); colours : (F, 3) red, green, blue."""

    vertices: FloatArray
    triangles: NDArray[np.int32]
    colours: Colours


class Lines(NamedTuple):
    """N polylines to draw.

    points : (P, 3) m, local frame; starts : (N + 1,) index of each line's first point, then P
    """

    points: FloatArray
    starts: NDArray[np.int64]


NO_LINES = Lines(points=np.empty((0, 3)), starts=np.zeros(1, dtype=np.int64))


class DrapedMap(NamedTuple):
    """A hazard map over the terrain.

    title, unit : for the legend; largest : value of the last colour, in `unit`; mesh : None if no rock reached a cell
    raised : distance (m) of the map from the ground
    has_few : True if ground has the colour FEW_COLOUR, because too few rocks for a value reached it
    caption : words on the values and the size of the map's facets
    """

    title: str
    unit: str
    largest: float
    mesh: DrawnMesh | None
    raised: float = 0.0
    has_few: bool = False
    caption: str = ""


def ground_seen(terrain: Terrain) -> Seen:
    """Return the terrain to draw, reduced to about MOST_TRIANGLES triangles, so that browsers can turn it smoothly."""
    number = len(terrain.triangles)
    vertices, triangles = terrain.vertices, terrain.triangles
    if number > MOST_TRIANGLES:
        vertices, triangles = decimated_mesh(vertices, triangles, MOST_TRIANGLES / number)
    return Seen(vertices=vertices, triangles=triangles.astype(np.int32), of=number)


def ground_mesh(seen: Seen) -> DrawnMesh:
    """Return the triangles of the terrain in colours that are shaded by a light in the north-west, as on maps."""
    shade = np.clip(0.5 + 0.5 * (unit_normals(seen.vertices, seen.triangles) @ LIGHT), 0.0, 1.0)[:, None]
    colours = (DARK + shade * (LIGHT_COLOUR - DARK)).astype(np.uint8)
    return DrawnMesh(vertices=seen.vertices, triangles=seen.triangles, colours=colours)


def path_lines(run: Run) -> Lines:
    """Return the recorded paths of the rocks flown so far, at most `outputs.trajectories` of the scene."""
    paths = run.flights.paths
    rows = displayed_rows(paths, run.scene.outputs.trajectories)
    if not len(rows):
        return NO_LINES
    samples = sample_paths(paths, rows, gravity=run.scene.gravity)
    return Lines(points=samples.x, starts=np.append(samples.starts, len(samples.x)))


def hazard_map(seen: Seen, maps: HazardMaps, kind: str) -> DrapedMap:
    """Return a hazard map of a run draped over the terrain.

    seen : the terrain to draw, from `ground_seen`; maps : hazard maps of the run; kind : REACH or ENERGY
    """
    title, unit, laid_out = _reach(maps) if kind == REACH else _energy(maps)
    if np.isnan(laid_out).all():
        return DrapedMap(title=title, unit=unit, largest=0.0, mesh=None)
    grid = _grid(maps, laid_out)
    near = _near(seen, grid)
    corners, drawn = draped(near, grid)
    largest = float(np.nanmax(laid_out))
    triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    few = drawn == FEW
    colours = np.where(few[:, None], np.array(FEW_COLOUR, dtype=np.uint8), ramp_colours(drawn / (largest or 1.0)))
    mesh = DrawnMesh(vertices=corners.reshape(-1, 3), triangles=triangles, colours=colours)
    return DrapedMap(
        title, unit, largest, mesh if len(corners) else None, raised_by(near), has_few=bool(few.any()),
        caption=caption_of([(corners, grid.cell)], bool(few.any())),
    )  # fmt: skip


def _reach(maps: HazardMaps) -> tuple[str, str, FloatArray]:
    """Return title, unit and values (C,) of the map of reach probability; NaN in cells without a value.

    With parameter sets, the map is the upper end of the predictive interval, as is the first map in the 3D view of a
    report. Without such intervals, the map of a scene with several sources shows the worst source of each cell. Other
    scenes have the share of all rocks. The title states which map is shown. If the share of all rocks is shown because
    too few sets have flown for an interval, the title states this as well.
    """
    band = maps.reach_band
    if band is not None and np.isfinite(band.high).any():
        high = np.full(maps.cells.count, np.nan)
        high[band.cell] = np.where(band.high > 0.0, 100.0 * band.high, np.nan)
        return UPPER_REACH, "%", high
    if maps.worst_cells is not None:
        return WORST_REACH, "%", maps.cells.everywhere(100.0 * maps.worst_cells.reach, np.nan)
    title = "reach probability" if band is None else "reach probability, mean; its predictive interval is unknown"
    values = 100.0 * reach_probability(maps.cells, maps.flown)
    return title, "%", maps.cells.everywhere(np.where(maps.cells.rocks > 0, values, np.nan), np.nan)


def _energy(maps: HazardMaps) -> tuple[str, str, FloatArray]:
    """Return title, unit and values (C,) of the map of p95 energy.

    The value is FEW in a reached cell without a p95 energy, and NaN in a cell that no rock reached.
    """
    worst = maps.worst_cells
    values = (maps.cells.energy.p95 if worst is None else worst.energy) / 1e3
    known = np.where(values > 0.0, values, FEW)
    laid_out = maps.cells.everywhere(np.where(maps.cells.rocks > 0, known, np.nan), np.nan)
    return f"{'p95 energy' if worst is None else WORST_ENERGY}, cells with {FEWEST_ROCKS} rocks or more", "kJ", laid_out


def _grid(maps: HazardMaps, laid_out: FloatArray) -> HazardGrid:
    """Return a hazard map as a grid; laid_out : (C,) values of all cells of the map's raster."""
    raster = maps.raster
    values = laid_out.reshape(raster.ny, raster.nx)
    return HazardGrid(values=values, x=raster.x, y=raster.y, dx=raster.cell, dy=raster.cell)


def _near(seen: Seen, grid: HazardGrid) -> Seen:
    """Return the part of the terrain around the cells of a map that have a value.

    `draped` lifts a map by a share of the extent of its terrain, so a small part keeps the map close to the ground.
    """
    rows, columns = np.nonzero(~np.isnan(grid.values))
    low = np.array([grid.x + grid.dx * (columns.min() - 1), grid.y + grid.dy * (rows.min() - 1)])
    high = np.array([grid.x + grid.dx * (columns.max() + 2), grid.y + grid.dy * (rows.max() + 2)])
    plan = seen.vertices[seen.triangles][:, :, :2]
    near = ((plan.max(axis=1) >= low) & (plan.min(axis=1) <= high)).all(axis=1)
    used, inverse = np.unique(seen.triangles[near], return_inverse=True)
    return Seen(vertices=seen.vertices[used], triangles=inverse.reshape(-1, 3).astype(np.int32), of=seen.of)


def downhill(seen: Seen, places: FloatArray) -> FloatArray:
    """Return the direction in plan, a unit vector (2,), from places (N, 3) m to the lower ground around them.

    Ground counts within three times the extent of the places, at least within NEARBY (100 m). If no ground there is
    lower, the result points south.
    """
    middle = places.mean(axis=0)
    reach = max(NEARBY, 3.0 * float(np.ptp(places[:, :2], axis=0).max()))
    away = seen.vertices - middle
    near = (np.hypot(away[:, 0], away[:, 1]) < reach) & (away[:, 2] < 0.0)
    towards = (away[near, :2] * -away[near, 2:]).sum(axis=0)
    length = float(np.hypot(*towards))
    return towards / length if length > 0.0 else np.array([0.0, -1.0])


def ramp_colours(shares: FloatArray) -> Colours:
    """Return the colours (N, 3) of a hazard map's values; shares : (N,) values over the largest value (-), 0 to 1."""
    at = np.linspace(0.0, 1.0, len(RAMP))
    return np.stack([np.interp(shares, at, channel) for channel in RAMP.T], axis=1).astype(np.uint8)


def release_lines(sources: Sequence[Source], seen: Seen) -> tuple[FloatArray, Lines]:
    """Return the points (N, 3) m of sources to mark, at most MOST_MARKS, and the lines of line sources.

    Area sources are marked at the middles of their triangles.
    """
    points, parts = [np.empty((0, 3))], list[FloatArray]()
    for source in sources:
        if source.triangles is not None:
            points.append(source.triangles.corners.mean(axis=1))
            continue
        if source.line:
            ends = [0, *source.breaks, len(source.points)]
            parts += [on_ground(seen, source.points[a:b]) for a, b in pairwise(ends)]
        points.append(source.points)
    found = np.concatenate(points)
    return on_ground(seen, found[spread_over(len(found), MOST_MARKS)]), lines_of(parts)


def lines_of(parts: Sequence[FloatArray]) -> Lines:
    """Return polylines, given the points (N, 3) m of each."""
    if not parts:
        return NO_LINES
    starts = np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)
    return Lines(points=np.concatenate(parts), starts=starts)


def area_lines(seen: Seen, areas: Mapping[str, Sequence[FloatArray]]) -> Lines:
    """Return the outlines of areas of interest as lines on the ground; areas : rings (N, 2) m in plan, by name."""
    ground = seen.terrain
    return lines_of([line for rings in areas.values() for line in draped_outlines(ground, rings)])


def barrier_mesh(obstacles: Obstacles) -> DrawnMesh | None:
    """Return the panels of all barriers of a scene; None without barriers."""
    walls = obstacles.walls
    if not walls:
        return None
    firsts = np.cumsum([0, *(len(wall.vertices) for wall in walls[:-1])]).tolist()
    triangles = np.concatenate([wall.triangles + first for wall, first in zip(walls, firsts, strict=True)])
    return DrawnMesh(
        vertices=np.concatenate([wall.vertices for wall in walls]), triangles=triangles.astype(np.int32),
        colours=np.tile(BARRIER_COLOUR, (len(triangles), 1)),
    )  # fmt: skip


def lifted(lines: Lines, height: float) -> Lines:
    """Return polylines moved upwards by a height (m)."""
    return lines._replace(points=lines.points + np.array([0.0, 0.0, height]))


def marks_raised(seen: Seen) -> float:
    """Return the height (m) of marks above the ground: a share (MARKS_RAISED) of the terrain's extent in plan."""
    return MARKS_RAISED * float(np.ptp(seen.vertices[:, :2], axis=0).max())


def on_ground(seen: Seen, points: FloatArray) -> FloatArray:
    """Return points (N, 3) m moved to just above the ground, so that they can be seen.

    A point without ground below or above it gets the height of the nearest vertex in plan.
    """
    if not len(points):
        return points
    found, plan = points.copy(), seen.vertices[:, :2]
    height = heights_at(height_image(seen.terrain, points[:, :2], MARGIN), points[:, :2])
    for row in np.flatnonzero(np.isnan(height)):
        nearest = int(np.argmin(((plan - points[row, :2]) ** 2).sum(axis=1)))
        height[row] = seen.vertices[nearest, 2]
    found[:, 2] = height + marks_raised(seen)
    return found
