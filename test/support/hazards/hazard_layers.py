"""Compute hazard maps by brute force from points on the paths of rocks, to compare the written maps with in tests."""

from types import SimpleNamespace

import numpy as np

from rpf3d_core.hazard.maps import FEWEST_ROCKS, PERCENTILES, CellStatistics, HazardMaps, Layers, Raster
from rpf3d_core.hazard.raster import raster_over
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.plan_view import Window, seen_from_above

MASS = 1400.0


class Points:
    """Points on the paths of rocks; the last point of each rock is the place where the rock stopped.

    rock : (N,) number of the rock of each point; plan : (N, 2) m, local frame; t : (N,) s; speed : (N,) m/s
    height : (N,) m above ground; touching : (N,) True if the rock touches the ground
    last : (N,) True for the last point of a rock
    """

    def __init__(self, rock, plan, t, speed, height, touching):
        """Keep the arrays; their rows are grouped by rock, in order of time."""
        self.rock, self.plan, self.t, self.speed, self.height, self.touching = rock, plan, t, speed, height, touching
        self.last = np.append(rock[1:] != rock[:-1], True)


def lines_of_rocks(terrain: Terrain, rocks: int = 300, points: int = 80, seed: int = 7) -> Points:
    """Return random points of rocks that fly from one place near the western rim of a terrain to the east.

    Each rock flies a random share of 70 % of the terrain's width. points : number of points of each rock
    """
    random = np.random.default_rng(seed)
    low, high = terrain.vertices[:, :2].min(axis=0), terrain.vertices[:, :2].max(axis=0)
    start = np.array([0.88 * low[0] + 0.12 * high[0], (low[1] + high[1]) / 2])
    along = np.linspace(0.0, 1.0, points) * random.beta(2.0, 3.0, rocks)[:, None]
    azimuth = random.normal(0.0, 0.12, rocks)
    way = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1) * (high[0] - low[0]) * 0.7
    plan = start + along[:, :, None] * way[:, None, :] + random.normal(0.0, 1.0, (rocks, points, 2))
    speed = 25.0 * np.sqrt(along * (1.2 - along)) * random.lognormal(0.0, 0.3, (rocks, points))
    height = 4.0 * random.random((rocks, points)) * (1.0 + 5.0 * along)
    return Points(
        np.repeat(np.arange(rocks), points),
        plan.reshape(-1, 2),
        np.tile(np.linspace(0.0, 12.0, points), rocks) + np.repeat(random.random(rocks), points),
        speed.ravel(),
        height.ravel(),
        random.random(rocks * points) < 0.2,
    )


def laid_out(layers: Layers) -> SimpleNamespace:
    """Return the layers as arrays (C,) of all cells; counts are 0 and statistics NaN in cells that no rock reached."""

    def column(values):
        return layers.everywhere(values, 0 if values.dtype.kind in "iu" else np.nan)

    def columns(values):
        return SimpleNamespace(**{name: column(array) for name, array in vars(values).items()})

    counts = {name: column(getattr(layers, name)) for name in ("rocks", "passages", "impacts", "deposits")}
    spreads = {name: columns(getattr(layers, name)) for name in ("energy", "speed", "height")}
    arrival, within = column(layers.first_arrival), layers.percentiles_within
    return SimpleNamespace(**counts, **spreads, first_arrival=arrival, percentiles_within=within)


def laid_out_maps(maps: HazardMaps) -> SimpleNamespace:
    """Return the maps, with the layers of cells, facets, zones and areas as arrays of all places (`laid_out`)."""
    kinds = {kind: laid_out(getattr(maps, kind)) for kind in ("cells", "facets", "zones", "areas")}
    return SimpleNamespace(**{**vars(maps), **kinds})


def maps_of(terrain: Terrain, points: Points, cell: float | None = None, areas=()) -> HazardMaps:
    """Return the hazard maps of points over a terrain.

    cell : size of the cells (m), None for the default; areas : pairs of a name and flags (N,), True inside the area
    """
    raster = raster_over(terrain, cell)
    facet = facets_below(terrain, points.plan)
    flown = int(points.rock.max()) + 1 if len(points.rock) else 0
    inside = [np.where(flag, number, -1) for number, (_, flag) in enumerate(areas)]
    nowhere = np.full(len(points.rock), -1)
    parts = [layers_of(points, where, len(areas)) for where in inside] or [layers_of(points, nowhere, 0)]
    return HazardMaps(
        flown,
        raster,
        layers_of(points, cell_of(raster, points.plan), raster.nx * raster.ny),
        layers_of(points, facet, len(terrain.triangles)),
        layers_of(points, np.where(facet < 0, -1, terrain.zone[facet]), len(terrain.zones)),
        _merged(parts),
        tuple(name for name, _ in areas),
    )


def cell_of(raster: Raster, plan: np.ndarray) -> np.ndarray:
    """Return the number of the raster's cell (N,) that contains each of points (N, 2) m; -1 outside the raster."""
    column, row = np.floor((plan - (raster.x, raster.y)) / raster.cell).astype(int).T
    inside = (column >= 0) & (column < raster.nx) & (row >= 0) & (row < raster.ny)
    return np.where(inside, row * raster.nx + column, -1)


def facets_below(terrain: Terrain, plan: np.ndarray, pixels: int = 500) -> np.ndarray:
    """Return the number of the facet (N,) below each of points (N, 2) m in plan; -1 outside the terrain.

    The facet is read from a view of the terrain from above, with `pixels` pixels along the longer side. Within a pixel
    of a facet's edge, the result may be the neighbouring facet.
    """
    low, high = terrain.vertices[:, :2].min(axis=0), terrain.vertices[:, :2].max(axis=0)
    shown = seen_from_above(terrain, Window(low[0], high[0], low[1], high[1]), pixels).facet
    at = np.floor((plan - low) / (high - low) * shown.shape[::-1]).astype(int)
    inside = ((at >= 0) & (at < shown.shape[::-1])).all(axis=1)
    column, row = np.where(inside[:, None], at, 0).T
    return np.where(inside, shown[row, column], -1)


def layers_of(points: Points, cell: np.ndarray, cells: int) -> Layers:
    """Return the layers of `cells` cells from points; cell : (N,) number of the cell of each point, -1 for none."""
    inside = cell >= 0
    rock, cell = points.rock[inside], cell[inside]
    entered = np.append(True, (cell[1:] != cell[:-1]) | (rock[1:] != rock[:-1])) if len(cell) else np.empty(0, bool)
    pair, place = np.unique(np.stack([cell, rock], axis=1), axis=0, return_inverse=True)
    arrival = np.full(cells, np.inf)
    np.minimum.at(arrival, cell, points.t[inside])

    def spread(values):
        most = np.full(len(pair), -np.inf)
        np.maximum.at(most, place.ravel(), values[inside])
        return spread_of(pair[:, 0], most, cells)

    everywhere = (
        np.bincount(pair[:, 0], minlength=cells),
        np.bincount(cell[entered], minlength=cells),
        np.bincount(cell[points.touching[inside]], minlength=cells),
        np.bincount(cell[points.last[inside]], minlength=cells),
        arrival,
        spread(0.5 * MASS * points.speed**2),
        spread(points.speed),
        spread(points.height),
    )
    return gathered(everywhere, everywhere[0] > 0)


def gathered(everywhere: tuple[np.ndarray, ...], kept: np.ndarray) -> Layers:
    """Return the layers of the kept cells (flags (C,)) from arrays (C,) and statistics (C, 6) of all cells."""
    *counts, arrival, energy, speed, height = (array[kept] for array in everywhere)
    spreads = [CellStatistics(*table.T) for table in (energy, speed, height)]
    return Layers(len(kept), np.flatnonzero(kept), *counts, arrival, *spreads, 0.0)


def spread_of(cell: np.ndarray, most: np.ndarray, cells: int) -> np.ndarray:
    """Return a table (C, 6) of the statistics of each cell: largest value, mean, and percentiles.

    All are NaN without rocks; the percentiles are NaN with fewer than FEWEST_ROCKS rocks.

    cell : (N,) cell of each value; most : (N,) largest value of one rock in this cell; cells : C
    """
    order = np.argsort(cell, kind="stable")
    reached, first = np.unique(cell[order], return_index=True)
    table = np.full((cells, 2 + len(PERCENTILES)), np.nan)
    for number, group in zip(reached, np.split(most[order], first[1:]), strict=False):
        table[number, :2] = group.max(), group.mean()
        if len(group) >= FEWEST_ROCKS:
            table[number, 2:] = np.percentile(group, PERCENTILES)
    return table


def _merged(parts: list[Layers]) -> Layers:
    """Return the layers of several areas in one `Layers`; areas may overlap, so each was counted separately.

    parts : layers of each area, in which only the row of this area is used
    """
    count = parts[0].count
    laid = [laid_out(part) for part in parts]

    def chosen(arrays):
        return np.array([array[number] for number, array in enumerate(arrays[:count])])

    def table(name):
        spreads = [getattr(part, name) for part in laid]
        columns = [chosen([getattr(one, key) for one in spreads]) for key in CellStatistics.__dataclass_fields__]
        return np.stack(columns, axis=-1).reshape(count, len(columns))

    names = ("rocks", "passages", "impacts", "deposits", "first_arrival")
    alone = tuple(chosen([getattr(part, name) for part in laid]) for name in names)
    return gathered((*alone, table("energy"), table("speed"), table("height")), alone[0] > 0)
