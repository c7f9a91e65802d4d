"""Hazard zones: which cells of the raster a level of reach probability or a class of a matrix takes in.

No level, class or threshold of any country or mine stands here: the scene names them all.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.maps import HazardMaps, reach_probability
from rpf3d_core.hazard.passages import reached_over
from rpf3d_core.terrain.frame import FloatArray

Flags = NDArray[np.bool_]


class Matrix(NamedTuple):
    """Classes by energy and reach probability.

    energy_levels (J) and probability_levels (-) : ascending; n levels part n + 1 bands, and a level belongs to the
        band above it
    classes : a row for each band of energy, from the lowest, with a name for each band of probability, from the
        lowest; None for no zone. One name may stand in several places.
    percentile : of energy, one of `maps.PERCENTILES`
    object_width : m, of what may be hit: probabilities are of hitting it; None for those of reaching a cell
    """

    energy_levels: tuple[float, ...]
    probability_levels: tuple[float, ...]
    classes: tuple[tuple[str | None, ...], ...]
    percentile: int
    object_width: float | None = None

    @property
    def names(self) -> list[str]:
        """Of the classes, in order of first mention, from the highest energy and probability down."""
        named = [name for row in reversed(self.classes) for name in reversed(row) if name is not None]
        return list(dict.fromkeys(named))


class Zone(NamedTuple):
    """Cells that belong together.

    kind : "reach_probability", all cells of at least a level (zones of lower levels contain those of higher ones), or
        "matrix", all cells of a class
    level : of reach probability (-), None for a class; name : of the class, None for a level
    cells : (C,) flag of each cell; guessed : how many of them took the largest energy for want of a percentile
    object_width : m, that the probabilities of a class are for; None where they are those of reaching a cell, which
        grow with the cell
    """

    kind: str
    level: float | None
    name: str | None
    cells: Flags
    guessed: int = 0
    object_width: float | None = None


def reach_zones(maps: HazardMaps, levels: Sequence[float]) -> list[Zone]:
    """A zone for each level (-) of reach probability, in the order given; of one that no cell has, without cells."""
    share = reach_probability(maps.cells, maps.flown)
    return [Zone("reach_probability", level, None, _flags(maps, share >= level)) for level in levels]


def matrix_zones(maps: HazardMaps, matrix: Matrix) -> list[Zone]:
    """A zone for each class of a matrix, the highest first, in cells that rocks came to.

    Fewer than 20 rocks have no percentile: such a cell takes its largest energy instead, which is never below the
    percentile, and its zone says how many did. To leave it out would be to call it safe.
    """
    width = matrix.object_width
    share = reach_probability(maps.cells, maps.flown) if width is None else reached_over(maps, width)
    energy, guessed = _energy(maps, matrix.percentile)
    row = np.searchsorted(matrix.energy_levels, energy, side="right")
    column = np.searchsorted(matrix.probability_levels, share, side="right")
    names = matrix.names
    number = np.array([[names.index(name) if name else -1 for name in line] for line in matrix.classes])
    found = number[row, column]
    zones = []
    for index, name in enumerate(names):
        belongs = found == index
        zones.append(Zone("matrix", None, name, _flags(maps, belongs), int((guessed & belongs).sum()), width))
    return zones


def _flags(maps: HazardMaps, belongs: Flags) -> Flags:
    """Flags (C,) of all cells from those (S,) of the cells that rocks came to."""
    return maps.cells.everywhere(belongs, False)


def _energy(maps: HazardMaps, percentile: int) -> tuple[FloatArray, Flags]:
    """The percentile of energy (S,) J, the largest where there is none, and a flag (S,) of where that is so."""
    energy = getattr(maps.cells.energy, f"p{percentile}")
    guessed = np.isnan(energy)
    return np.where(guessed, maps.cells.energy.largest, energy), guessed
