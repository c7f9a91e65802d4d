"""The hazard maps of an ensemble, from which files, pictures and tables are made.

A cell is a square of a raster in plan, a facet of the terrain, a zone, or an area of interest; all kinds have the same
figures (`Layers`). Rocks reach a few thousand of a mine's millions of cells, so only these cells are kept. Code that
needs a value in every cell lays out one quantity at a time (`Layers.everywhere`).
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray

CountArray = NDArray[np.int64]
StatisticArray = NDArray[Any]  # float32; code that draws maps does not depend on this type

PERCENTILES = (50, 90, 95, 99)
"""Percentiles in a map, over the distinct rocks that reached a cell, of each rock's largest value there."""
FEWEST_ROCKS = 20
"""Smallest number of distinct rocks for which a cell has percentiles; below it, p95 would be the largest value."""


@dataclass(frozen=True, eq=False)
class CellStatistics:
    """Statistics of one quantity, such as energy, in S cells that rocks reached.

    Each rock that reached a cell has one value there: its largest value in the cell. The statistics of the cell are
    taken over the values of these rocks. Every array is (S,), in the unit of the quantity.
    largest : rounded to float32
    mean : rounded to float32; its error before rounding is at most 2^-35 of the largest value that the scene allows
    p50, p90, p95, p99 : relative error at most `Layers.percentiles_within`; NaN for fewer than `FEWEST_ROCKS` rocks
    """

    largest: StatisticArray
    mean: StatisticArray
    p50: StatisticArray
    p90: StatisticArray
    p95: StatisticArray
    p99: StatisticArray


@dataclass(frozen=True, eq=False)
class Layers:
    """The map values of the S cells that rocks reached, out of C cells; every array is (S,).

    count : C, the number of all cells; cell : number of each cell, from 0 to C - 1, ascending
    rocks : distinct rocks that passed over the cell, touched it or stopped in it, at least 1
    passages : number of times that a rock entered the cell, or was released there
    impacts : number of impacts on the ground; deposits : rocks that stopped there, or that a barrier caught there
    first_arrival : s, shortest time from the release of a rock to its arrival
    energy : J, translational, plus rotational if rocks spin; speed : m/s; height : m, vertical, above the terrain
        straight below
    percentiles_within : bound of the relative error of every percentile (-)
    ways : (S, 2) sum over the rocks of the length of each rock's path in plan inside the cell, in cell widths, and sum
        of the squares of these lengths; shape (0, 0) if path lengths were not counted
    """

    count: int
    cell: CountArray
    rocks: CountArray
    passages: CountArray
    impacts: CountArray
    deposits: CountArray
    first_arrival: StatisticArray
    energy: CellStatistics
    speed: CellStatistics
    height: CellStatistics
    percentiles_within: float
    ways: FloatArray = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def has_ways(self) -> bool:
        """True if the path lengths in cells were counted, from which passages per metre follow."""
        return bool(self.ways.shape[1] > 0)

    def everywhere(self, values: NDArray[Any], elsewhere: float) -> NDArray[Any]:
        """Return an array (C,) over all cells: `values` (S,) in reached cells, `elsewhere` in all other cells."""
        laid_out = np.full(self.count, elsewhere, dtype=values.dtype)
        laid_out[self.cell] = values
        return laid_out


class ReachCounts(NamedTuple):
    """The S cells that rocks reached, out of C cells, where nothing is counted but rocks.

    all_cells : C; cell : (S,) number of each cell, ascending; rocks : (S,) distinct rocks that reached it, at least 1
    """

    all_cells: int
    cell: CountArray
    rocks: CountArray


class Raster(NamedTuple):
    """Square cells of a side `cell` (m) in plan, local frame: nx columns eastwards, ny rows northwards from x, y (m).

    Cell (i, j), in column i and row j, is number j nx + i. It reaches from x + i cell up to, but not including,
    x + (i + 1) cell, and from y + j cell up to, but not including, y + (j + 1) cell.
    """

    x: float
    y: float
    cell: float
    nx: int
    ny: int


@dataclass(frozen=True, eq=False)
class HazardMaps:
    """The hazard maps of an ensemble of `flown` rocks: values of map cells, facets, zones and areas of interest.

    cells : values of the C = nx ny squares of the raster; facets : values of the F facets, which rocks pass over in
        plan or touch; no facets if only `reached_facets` was counted
    zones : values of the Z zones; areas : values of the areas of interest, in the order of `area_names`. Passages of
        zones and areas, and heights of areas, are not counted: these values are 0
    barriers : `hazard.barriers.BarrierFigures` of each barrier, if the scene has barriers
    spins : True if rocks spin; energies then include rotation
    lost : number of rocks lost to holes of the terrain; each might have reached any cell or area
    sets : `hazard.by_set.sets.SetFigures` of the parameter sets, if the scene has unknowns
    reach_band : `hazard.by_set.sets.ReachBand`, the predictive intervals of reach probability, if there are parameter
        sets
    sources : `hazard.by_source.source_tallies.SourceMaps`, the values of zones and areas for each source, if there are
        several
    reached_facets : the number of rocks that reached each facet, of a live answer; None if `facets` was counted
    """

    flown: int
    raster: Raster
    cells: Layers
    facets: Layers
    zones: Layers
    areas: Layers
    area_names: tuple[str, ...]
    barriers: tuple[Any, ...] = ()
    spins: bool = False
    lost: int = 0
    sets: Any = None
    reach_band: Any = None
    sources: Any = None
    reached_facets: ReachCounts | None = None

    @property
    def energy_kind(self) -> str:
        """The kind of kinetic energy in the hazard maps, in words for titles and files."""
        return "translational and rotational" if self.spins else "translational"

    @property
    def worst_cells(self) -> Any:
        """The largest values of any single source in each cell, a `source_cells.WorstCells`; None if unknown."""
        return None if self.sources is None else self.sources.cells


def reach_probability(layers: Layers | ReachCounts, flown: int) -> FloatArray:
    """Return the reach probability (S,) (-) of S cells: the share of all rocks flown that reached each cell.

    The probability is for a rock that falls; it does not state how often rocks fall. Source: Hantz et al. 2021,
    Geosciences 11:158.
    """
    return np.asarray(layers.rocks / max(flown, 1))
