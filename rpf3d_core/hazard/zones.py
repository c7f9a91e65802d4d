"""Hazard zones: the map cells with at least a given reach probability, or with a class of a hazard matrix.

The scene sets all levels, classes and thresholds; rpf3d has no built-in values of a country or mine.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.by_source.source_cells import P95
from rpf3d_core.hazard.maps import HazardMaps, reach_probability
from rpf3d_core.hazard.passages import reached_over
from rpf3d_core.terrain.frame import FloatArray

Flags = NDArray[np.bool_]

REACH, CLASS = "reach_probability", "matrix"
"""`Zone.kind` of zones that count all rocks together."""
UPPER = "reach_probability_upper"
"""`Zone.kind` of zones for the upper end of the predictive interval of reach probability."""

WORST_REACH, WORST_CLASS = "reach_probability_worst_source", "matrix_worst_source"
"""`Zone.kind` of zones that count the rocks of each source, so that harmless sources do not hide a dangerous one."""


class Matrix(NamedTuple):
    """A hazard matrix: the user's classes by energy and probability, such as "low" and "high".

    energy_levels (J) and probability_levels (-) : ascending; n levels separate n + 1 bands, and a level belongs to the
        band above it
    classes : a row for each band of energy, from the lowest, with a name for each band of probability, from the
        lowest; None for no zone. A name may occur several times.
    percentile : the percentile of energy that is compared with the levels, one of `maps.PERCENTILES`
    object_width : width of an object that rocks may hit, measured across their path, plus the diameter of a rock (m).
        The probability is then the probability of a hit; if None, it is the reach probability of the cell
    """

    energy_levels: tuple[float, ...]
    probability_levels: tuple[float, ...]
    classes: tuple[tuple[str | None, ...], ...]
    percentile: int
    object_width: float | None = None

    @property
    def names(self) -> list[str]:
        """Names of the classes of the matrix, each once, from the highest energy and probability down."""
        named = [name for row in reversed(self.classes) for name in reversed(row) if name is not None]
        return list(dict.fromkeys(named))


class Zone(NamedTuple):
    """A hazard zone: the map cells of one level of reach probability, or of one class of the matrix.

    kind : which cells belong to the zone. Zones of lower levels contain zones of higher levels
        REACH : cells whose reach probability is at least the level
        UPPER : cells for which the upper end of the predictive interval is at least the level, or unknown
        CLASS : cells of a class of the matrix
        WORST_REACH : cells that the rocks of at least one source reached with a share of at least the level
        WORST_CLASS : cells of a class of the matrix, by the largest values of any single source
    level : of reach probability (-), None for a class; name : of the class, None for a level
    cells : (C,) True for each cell of the zone; guessed : number of cells of the zone whose largest energy replaces a
        missing percentile
    object_width : width of an object that may be hit, plus the diameter of a rock (m); None if probabilities refer to a
        cell, so that they grow with the size of the cell
    """

    kind: str
    level: float | None
    name: str | None
    cells: Flags
    guessed: int = 0
    object_width: float | None = None


def reach_zones(maps: HazardMaps, levels: Sequence[float]) -> list[Zone]:
    """Return a hazard zone for each level (-) of reach probability, in the order given; a zone may have no cells."""
    share = reach_probability(maps.cells, maps.flown)
    return [
        Zone(kind=REACH, level=level, name=None, cells=_flags(maps, share >= level)) for level in levels
    ]


def upper_zones(maps: HazardMaps, levels: Sequence[float]) -> list[Zone]:
    """Return a hazard zone for each level (-) of the upper end of the predictive interval of reach probability.

    Such a zone contains the zone of `reach_zones` for this level, and the cells that may reach the level, depending on
    the unknowns of the scene. It also contains the reached cells whose predictive interval is unknown, because too few
    parameter sets have flown. Without parameter sets the list is empty.
    """
    if maps.reach_band is None:
        return []
    band, zones = maps.reach_band, []
    for level in levels:
        cells = np.zeros(maps.cells.count, dtype=bool)
        cells[band.cell] = ~(band.high < level)  # an unknown end is NaN and counts as high enough
        zones.append(Zone(kind=UPPER, level=level, name=None, cells=cells))
    return zones


def matrix_zones(maps: HazardMaps, matrix: Matrix) -> list[Zone]:
    """Return one hazard zone for each class of the hazard matrix, highest class first: the reached cells of the class.

    A cell with fewer than 20 rocks has no percentile (NaN). Its largest energy is used instead, which is never below
    the percentile; `Zone.guessed` is the number of such cells. Without this rule, NaN would put such a cell in the
    highest band of energy.
    """
    width = matrix.object_width
    share = reach_probability(maps.cells, maps.flown) if width is None else reached_over(maps, width)
    energy, guessed = _energy(maps, matrix.percentile)
    return _classes(maps, matrix, CLASS, share, energy, guessed)


def worst_reach_zones(maps: HazardMaps, levels: Sequence[float]) -> list[Zone]:
    """Return a hazard zone for each level (-) of the largest share, over all sources, of a source's rocks.

    Such a zone contains the zone of `reach_zones` for this level. The list is empty if the shares of single sources are
    not known.
    """
    if maps.worst_cells is None:
        return []
    share = maps.worst_cells.reach
    return [Zone(kind=WORST_REACH, level=level, name=None, cells=_flags(maps, share >= level)) for level in levels]


def worst_matrix_zones(maps: HazardMaps, matrix: Matrix) -> list[Zone]:
    """Return a hazard zone for each class of the matrix, by the largest share and largest energy of any single source.

    The share and the energy of a cell may come from different sources. So the class of a cell is never below the class
    by the rocks of one source, but may be above. The energy is the p95 energy, also if the matrix uses a lower
    percentile. The energy is the largest energy in the cell if the matrix uses the 99th percentile, or if a source has
    rocks in the cell, but too few for a percentile. The list is empty if the largest values are not known, or if the
    matrix has the width of an object, because passages per metre are not counted for each source.
    """
    worst = maps.worst_cells
    if worst is None or matrix.object_width is not None:
        return []
    guessed = worst.has_few | np.isnan(worst.energy) | (matrix.percentile > P95)
    energy = np.where(guessed, maps.cells.energy.largest, worst.energy)
    return _classes(maps, matrix, WORST_CLASS, worst.reach, energy, guessed)


def _classes(
    maps: HazardMaps, matrix: Matrix, kind: str, share: FloatArray, energy: FloatArray, guessed: Flags
) -> list[Zone]:
    """Return a hazard zone of a kind for each class of the matrix, the highest class first.

    share (S,) -, energy (S,) J : of the reached cells; guessed : (S,) True where the largest energy replaces an unknown
        percentile
    """
    row = np.searchsorted(matrix.energy_levels, energy, side="right")
    column = np.searchsorted(matrix.probability_levels, share, side="right")
    names = matrix.names
    number = np.array([[names.index(name) if name else -1 for name in line] for line in matrix.classes])
    found = number[row, column]
    zones = []
    for index, name in enumerate(names):
        belongs = found == index
        zones.append(
            Zone(
                kind=kind,
                level=None,
                name=name,
                cells=_flags(maps, belongs),
                guessed=int((guessed & belongs).sum()),
                object_width=matrix.object_width,
            )
        )
    return zones


def _flags(maps: HazardMaps, belongs: Flags) -> Flags:
    """Return flags (C,) for all map cells from flags (S,) for the reached cells."""
    return maps.cells.everywhere(belongs, False)


def _energy(maps: HazardMaps, percentile: int) -> tuple[FloatArray, Flags]:
    """Return the energies (S,) J that the matrix uses, and flags (S,), True for a cell without a percentile.

    The energy of a cell is the given percentile; in a cell without a percentile, it is the largest energy.

    percentile : number of the percentile, one of `maps.PERCENTILES`
    """
    energy = getattr(maps.cells.energy, f"p{percentile}")
    guessed = np.isnan(energy)
    return np.where(guessed, maps.cells.energy.largest, energy), guessed
