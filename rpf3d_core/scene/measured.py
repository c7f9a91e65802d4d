"""Sizes of rocks in a scene: a number, a distribution, or a list of measured sizes."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Discriminator, Field, SerializerFunctionWrapHandler, Tag, model_serializer, model_validator

from rpf3d_core.formats.numbers import NumberColumn, read_column
from rpf3d_core.formats.units import (
    SI,
    doubt_on_unit,
    key_of_sizes,
    other_length_named,
    other_quantity,
    other_quantity_named,
)
from rpf3d_core.materials.distributions import Distribution, Measured
from rpf3d_core.scene.draws import MEASURED, Draw, distribution_of, drawn
from rpf3d_core.scene.values import InputFile, Name, Number, StrictModel, refuse

Numbers = Annotated[tuple[Number, ...], Field(min_length=1)]


class MeasuredList(StrictModel):
    """Measured sizes, from which sizes are drawn with replacement."""

    measured: Annotated[
        Annotated[InputFile, Tag("[file]")] | Annotated[Numbers, Tag("[numbers]")],
        Discriminator(lambda value: "[numbers]" if isinstance(value, list | tuple) else "[file]"),
    ] = Field(description="a list of at least one number, or the path of a file with a number on each line")
    column: Name | None = Field(
        None, description="the name of the column of the file that holds the sizes, or left out if there is one only"
    )

    @model_validator(mode="after")
    def _column_of_a_file(self) -> Self:
        if self.column is not None and isinstance(self.measured, tuple):
            raise refuse("is given, but the sizes are in the scene and not in a file", "column")
        return self

    @model_validator(mode="after")
    def _can_be_read(self) -> Self:
        if isinstance(self.measured, Path):
            read_column(self.measured, self.column, "length")  # here, so that a message names the key of the file
        return self

    @model_serializer(mode="wrap")
    def _without_an_empty_column(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Return the content of the section; leave out an unused `column`, so that old scenes keep their digest."""
        return {key: value for key, value in plain(self).items() if key != "column" or value is not None}

    def sizes(self, measure: str) -> Measured:
        """Return the sizes (m, kg or m3) in ascending order, to draw from; measure : `diameter`, `mass` or `volume`.

        Raises
        ------
        InputError
            The file is damaged; the message names the file and the line.
        """
        if isinstance(self.measured, tuple):
            return Measured(values=np.sort(np.array(self.measured).astype(float)))
        return Measured(values=np.sort(self._column(self.measured, measure).values))

    def _column(self, file: Path, measure: str) -> NumberColumn:
        return read_column(file, self.column, _quantity(measure))

    def column_of(self, measure: str) -> NumberColumn | None:
        """Return the column of the file that holds the sizes; None if the sizes are in the scene.

        measure : the key of the sizes, such as `mass`
        """
        return None if isinstance(self.measured, tuple) else self._column(self.measured, measure)

    def check_sizes(self, measure: str) -> None:
        """Raise a PydanticCustomError for sizes not above 0, or for a column of another quantity, such as `tonnage`.

        measure : the key of the sizes: `diameter`, `mass` or `volume`
        """
        quantity = _quantity(measure)
        if isinstance(self.measured, Path):
            self._check_quantity(self.measured, measure)
        sizes = self.sizes(measure)
        if sizes.low <= 0.0:
            drawn_from = f"from {sizes.low:g} to {sizes.high:g} {SI[quantity]}"
            raise refuse(f"may be drawn {drawn_from}, but must be above 0", measure)

    def _check_quantity(self, file: Path, measure: str) -> None:
        """Raise a PydanticCustomError if a column's name, by unit or word, states another quantity than `measure`."""
        found, quantity = self._column(file, measure), _quantity(measure)
        name = found.name or ""
        if length := other_length_named(name):
            raise refuse(f"needs diameters, masses or volumes, but the name of the column {name!r} states {length}",
                         measure)  # fmt: skip
        if found.unit is not None and found.unit.quantity != quantity:
            raise refuse(f"has sizes {other_quantity(name, found.unit, quantity)}", measure)
        other = other_quantity_named(name, quantity) if found.unit is None else None
        if other is not None:
            raise refuse(
                f"is a {quantity} ({SI[quantity]}), but the name of the column {name!r} states a {other}; give the "
                f"column to the key `{key_of_sizes(other)}`, with its unit in brackets if it is not {SI[other]}, or "
                f"rename it if it holds a {quantity}", measure,
            )  # fmt: skip

    def describe(self, measure: str, unit: str) -> str:
        """Return a sentence with file, column, unit, number and range of the sizes; "" if the sizes are not in a file.

        measure : the key of the sizes, such as `mass`; unit : the unit of this key in a scene, such as kg
        """
        if isinstance(self.measured, tuple):
            return ""
        found = self._column(self.measured, measure)
        column = f"column {found.name!r}" if found.name else "the only column"
        if found.unit is not None and found.unit.name != unit:
            unit = f"{found.unit.name} and converted to {unit}"
        low, high = float(found.values.min()), float(found.values.max())
        return (f"{measure}: {column} of {self.measured.name}, read in {unit}: {len(found.values):,} values from "
                f"{low:g} to {high:g}")  # fmt: skip

    def doubt(self, measure: str) -> str:
        """Return a warning if the name of the column leaves the unit or the kind of length in doubt; "" without doubt.

        For example, the end of `mass_t` is read as tonnes, but may have another meaning. Sizes in the scene have no
        column, and no doubt.

        measure : the key of the sizes, such as `mass`
        """
        if isinstance(self.measured, tuple):
            return ""
        doubt = doubt_on_unit(self._column(self.measured, measure).name or "", _quantity(measure))
        return f"{self.measured.name}: {doubt}" if doubt else ""


def _quantity(measure: str) -> str:
    """Return the quantity of sizes, a key of `SI`: "length" for `diameter`, else `measure` itself (mass, volume)."""
    return "length" if measure == "diameter" else measure


if TYPE_CHECKING:
    Size = float | Draw | MeasuredList
else:
    Size = drawn("", further={MEASURED: MeasuredList}, gt=0)


def check_sizes(spec: StrictModel, measures: Sequence[str]) -> None:
    """Raise a PydanticCustomError if measured sizes of a section are not above 0, or not of the quantity of their key.

    spec : the section; measures : the keys of sizes that it may have, such as `mass`
    """
    for measure in measures:
        size = getattr(spec, measure)
        if isinstance(size, MeasuredList):
            size.check_sizes(measure)


def sizes_from(value: float | Draw | MeasuredList, measure: str) -> Distribution | Measured:
    """Return the distribution, or the measured sizes (m, kg or m3), from which sizes of rocks are drawn.

    value : number, distribution or measured sizes in the scene; measure : the key of the value, such as `mass`
    """
    return value.sizes(measure) if isinstance(value, MeasuredList) else distribution_of(value)
