"""Sizes of rocks in a scene: a number, a distribution, or a list of measured sizes."""

from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Discriminator, Field, Tag

from rpf3d_core.formats.numbers import read_numbers
from rpf3d_core.materials.distributions import Distribution, Measured
from rpf3d_core.scene.draws import MEASURED, Draw, distribution_of, drawn
from rpf3d_core.scene.values import InputFile, Number, StrictModel

Numbers = Annotated[tuple[Number, ...], Field(min_length=1)]


class MeasuredList(StrictModel):
    """Measured sizes, from which sizes are drawn with replacement."""

    measured: Annotated[
        Annotated[InputFile, Tag("[file]")] | Annotated[Numbers, Tag("[numbers]")],
        Discriminator(lambda value: "[numbers]" if isinstance(value, list | tuple) else "[file]"),
    ] = Field(description="a list of at least one number, or the path of a file with a number on each line")

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest size that can be drawn."""
        prepared = self.prepared
        return prepared.low, prepared.high

    @property
    def prepared(self) -> Measured:
        """The sizes in the form from which they are drawn.

        Raises
        ------
        InputError
            The file is damaged; names it and the line.
        """
        values = np.array(self.measured) if isinstance(self.measured, tuple) else read_numbers(self.measured)
        return Measured(values=np.sort(values.astype(float)))


if TYPE_CHECKING:
    Size = float | Draw | MeasuredList
else:
    Size = drawn("", further={MEASURED: MeasuredList}, gt=0)


def sizes_from(value: float | Draw | MeasuredList) -> Distribution | Measured:
    """Return what sizes are drawn from, for a value of a scene."""
    return value.prepared if isinstance(value, MeasuredList) else distribution_of(value)
