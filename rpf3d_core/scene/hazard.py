"""The scene's key `hazard`: the raster of the maps, the levels of the zones, and the memory limit of the maps.

Only the three levels of reach probability have defaults. Other levels and classes have no defaults, because thresholds
differ between countries and mines, and a different threshold changes the zones strongly (Abbruzzese and Labiouse,
EPFL infoscience 162547).
"""

from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from rpf3d_core.hazard.zones import Matrix
from rpf3d_core.scene.values import Name, Number, StrictModel, refuse

JOULE_PER_KJ = 1000.0

LEAST_CELL = 0.01
"""Smallest cell size (m) that a scene may have.

No survey is so detailed, and the number of smaller cells may overflow an integer.
"""

REACH_LEVELS = (0.01, 0.1, 0.5)
"""Default levels of the reach probability (-): round shares for display, not thresholds of a regulation."""


def _ascending(levels: tuple[float, ...]) -> tuple[float, ...]:
    if any(low >= high for low, high in pairwise(levels)):
        raise refuse(f"is {list(levels)}, but must rise from each number to the next")
    return levels


def _table(rows: Any) -> Any:
    """Return the table of class names of a matrix unchanged.

    Raise a PydanticCustomError unless the table is a list of lists whose items are names or None.
    """
    if not isinstance(rows, list | tuple) or not all(isinstance(row, list | tuple) for row in rows):
        raise refuse("must be a table of class names: one list of names per energy band, lowest first")
    for number, row in enumerate(rows, start=1):
        for name in row:
            if name is not None and not (isinstance(name, str) and name):
                raise refuse(f"has {name!r} in its row {number}, but must have names, or null for no zone")
    return rows


Share = Annotated[Number, Field(gt=0, le=1)]
Shares = Annotated[tuple[Share, ...], Field(min_length=1), AfterValidator(_ascending)]
Energies = Annotated[tuple[Annotated[Number, Field(gt=0)], ...], Field(min_length=1), AfterValidator(_ascending)]


class MatrixSpec(StrictModel):
    """Hazard classes by energy and reach probability.

    n levels separate n + 1 bands; a value equal to a level belongs to the upper band.
    """

    energy_levels_kj: Energies = Field(description="a list of numbers above 0 (kJ), ascending")
    probability_levels: Shares = Field(description="a list of shares above 0 and up to 1 (-), ascending")
    classes: Annotated[tuple[tuple[Name | None, ...], ...], BeforeValidator(_table)] = Field(
        description=(
            "a table of class names: one row per energy band, lowest first; in each row one name per band of reach "
            "probability, lowest first; null: no zone"
        )
    )
    object_width: Number | None = Field(
        None,
        gt=0,
        description="a width above 0 (m) across the rocks' path: the width of an object plus the diameter of a rock; "
        "the probabilities are then those of hitting the object; left out: those of reaching a cell",
    )

    @model_validator(mode="after")
    def _one_class_a_band(self) -> Self:
        rows, columns = len(self.energy_levels_kj) + 1, len(self.probability_levels) + 1
        lengths = [len(row) for row in self.classes]
        if lengths != [columns] * rows:
            raise refuse(
                f"has rows of {', '.join(map(str, lengths)) or 'no'} names, but must have {rows} rows of {columns} "
                f"names: {rows - 1} energy levels part {rows} bands, {columns - 1} probability levels {columns}",
                "classes",
            )
        return self


class HazardSpec(StrictModel):
    """The settings of the hazard maps. The maps show consequences of a released rock, not the frequency of releases."""

    cell: Number | None = Field(
        None,
        ge=LEAST_CELL,
        description=f"a length of at least {LEAST_CELL} (m), the side of a cell; left out: chosen so that most "
        "cells on the rocks' paths get the 20 rocks that a percentile needs",
    )
    reach_levels: Shares = Field(
        REACH_LEVELS, description="a list of shares above 0 and up to 1 (-), ascending; a zone is drawn for each"
    )
    energy_percentile: Literal[50, 90, 95, 99] = Field(
        95, description="50, 90, 95 or 99, the percentile of energy for the matrix"
    )
    matrix: MatrixSpec | None = Field(
        None, description="a mapping with energy_levels_kj, probability_levels and classes; left out: no classes"
    )
    passage_per_metre: bool = Field(
        False,
        strict=True,
        description="true or false, whether passages per metre of width across the path are mapped; their number does "
        "not depend on the cell size",
    )
    memory_gb: Number = Field(
        1.0, gt=0, description="a number above 0 (GB of 10^9 bytes), the largest memory of the maps"
    )


def matrix_of(spec: HazardSpec) -> Matrix | None:
    """Return the hazard matrix of a scene, with energies in J, for the hazard zones; None if there is no matrix."""
    if spec.matrix is None:
        return None
    levels = tuple(JOULE_PER_KJ * level for level in spec.matrix.energy_levels_kj)
    matrix = spec.matrix
    return Matrix(
        energy_levels=levels,
        probability_levels=matrix.probability_levels,
        classes=matrix.classes,
        percentile=spec.energy_percentile,
        object_width=matrix.object_width,
    )


def asks_ways(spec: HazardSpec) -> bool:
    """Return True if the hazard maps of a scene need passages per metre, for which cells count the lengths of paths."""
    return spec.passage_per_metre or (spec.matrix is not None and spec.matrix.object_width is not None)
