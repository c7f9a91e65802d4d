"""Numbers in a scene that may be random: a fixed number, or one of six bounded distributions."""

from collections.abc import Mapping
from functools import partial, reduce
from operator import or_
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from rpf3d_core.materials.distributions import (
    Distribution,
    fixed,
    triangular_between,
    truncated_lognormal,
    truncated_normal,
    truncated_power_law,
    truncated_weibull,
    uniform_between,
)
from rpf3d_core.scene.values import Number, StrictModel, refuse

LEAST_SPAN = 1e-9
"""Smallest probability (-) that a Weibull distribution may have between its bounds, before it is cut off there.

With a smaller probability, drawn numbers lose precision.
"""


class Normal(StrictModel):
    """A normal distribution, cut off at its bounds; a scene states it as {mean, sd, min, max}, without a name."""

    mean: Number = Field(description="a number from min to max, the mean before the cut")
    sd: Number = Field(ge=0, description="a number >= 0, the standard deviation before the cut")
    min: Number = Field(description="a number below max; nothing below it is drawn")
    max: Number = Field(description="a number above min; nothing above it is drawn")

    @model_validator(mode="before")
    @classmethod
    def _without_a_name(cls, values: Any) -> Any:
        if isinstance(values, Mapping) and "normal" in values:
            raise refuse("is not a key: a normal distribution is written {mean, sd, min, max}", "normal")
        if isinstance(values, Mapping) and "measured" in values:
            raise refuse("is for sizes of rocks; give a number or a distribution", "measured")
        return values

    @model_validator(mode="after")
    def _mean_within_bounds(self) -> Self:
        rising(self.min, self.max)
        if not self.min <= self.mean <= self.max:
            raise refuse(
                f"is {self.mean:g}, but must lie between min {self.min:g} and max {self.max:g}: "
                "the bounds exclude the mean",
                "mean",
            )
        return self

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return truncated_normal(self.mean, self.sd, self.min, self.max)


class LognormalSpec(Normal):
    """A lognormal distribution, cut off at its bounds, with the mean and sd of the number, not of its logarithm.

    Mean and sd apply to the distribution before the cut.
    """

    @model_validator(mode="after")
    def _positive(self) -> Self:
        if self.min < 0.0:
            raise refuse(f"is {self.min:g}, but must be a number >= 0: a lognormal number is above 0", "min")
        if self.mean <= 0.0:
            raise refuse(f"is {self.mean:g}, but must be a number above 0: a lognormal number is above 0", "mean")
        return self

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return truncated_lognormal(self.mean, self.sd, self.min, self.max)


class PowerLawSpec(StrictModel):
    """A truncated power law, N(> x) ~ x^-exponent between two bounds.

    The exponent of rock volumes is usually 0.4 to 0.6 (Hungr et al. 1999; Dussauge et al. 2003; unconfirmed).
    """

    exponent: Number = Field(gt=0, description="a number above 0 (-), b in N(> x) ~ x^-b")
    min: Number = Field(gt=0, description="a number above 0 and below max")
    max: Number = Field(gt=0, description="a number above min")

    @model_validator(mode="after")
    def _bounds_rise(self) -> Self:
        rising(self.min, self.max)
        return self

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return truncated_power_law(self.exponent, self.min, self.max)


class Lognormal(StrictModel):
    """The form `{lognormal: {mean, sd, min, max}}` of a random number in a scene."""

    lognormal: LognormalSpec = Field(description="a mapping with mean, sd, min and max")

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number that can be drawn."""
        return self.lognormal.min, self.lognormal.max

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return self.lognormal.prepared


class PowerLaw(StrictModel):
    """The form `{power_law: {exponent, min, max}}` of a random number in a scene."""

    power_law: PowerLawSpec = Field(description="a mapping with exponent, min and max")

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number that can be drawn."""
        return self.power_law.min, self.power_law.max

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return self.power_law.prepared


class Uniform(StrictModel):
    """The form `{uniform: [low, high]}` of a random number in a scene: all numbers in between are equally likely."""

    uniform: tuple[Number, Number] = Field(description="two numbers [low, high] with low < high")

    @model_validator(mode="after")
    def _bounds_rise(self) -> Self:
        low, high = self.uniform
        if low >= high:
            raise refuse(f"is [{low:g}, {high:g}], but must be two numbers [low, high] with low < high", "uniform")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number that can be drawn."""
        return self.uniform

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return uniform_between(*self.uniform)


class WeibullSpec(StrictModel):
    """A Weibull distribution, cut off at its bounds; uncut, the share 1 - exp(-(x/scale)^shape) lies below x."""

    shape: Number = Field(gt=0, description="a number above 0 (-), k in 1 - exp(-(x/scale)^k)")
    scale: Number = Field(gt=0, description="a number above 0, below which 63 % of the numbers are before the cut")
    min: Number = Field(ge=0, description="a number >= 0 and below max; nothing below it is drawn")
    max: Number = Field(description="a number above min; nothing above it is drawn")

    @model_validator(mode="after")
    def _leaves_something(self) -> Self:
        rising(self.min, self.max)
        if self.prepared.span < LEAST_SPAN:
            cut = f"min {self.min:g} and max {self.max:g} cut off all its numbers"
            raise refuse(f"is {self.scale:g}, but {cut}", "scale")
        return self

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return truncated_weibull(self.shape, self.scale, self.min, self.max)


class Weibull(StrictModel):
    """The form `{weibull: {shape, scale, min, max}}` of a random number in a scene."""

    weibull: WeibullSpec = Field(description="a mapping with shape, scale, min and max")

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number that can be drawn."""
        return self.weibull.min, self.weibull.max

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return self.weibull.prepared


class TriangularSpec(StrictModel):
    """A triangular distribution between two bounds, densest at its mode."""

    min: Number = Field(description="a number below max, the smallest that is drawn")
    mode: Number = Field(description="a number from min to max, the most frequent one")
    max: Number = Field(description="a number above min, the largest that is drawn")

    @model_validator(mode="after")
    def _mode_within_bounds(self) -> Self:
        rising(self.min, self.max)
        if not self.min <= self.mode <= self.max:
            raise refuse(f"is {self.mode:g}, but must lie between min {self.min:g} and max {self.max:g}", "mode")
        return self


class Triangular(StrictModel):
    """The form `{triangular: {min, mode, max}}` of a random number in a scene."""

    triangular: TriangularSpec = Field(description="a mapping with min, mode and max")

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number that can be drawn."""
        return self.triangular.min, self.triangular.max

    @property
    def prepared(self) -> Distribution:
        """The distribution as a `Distribution`, the form from which a run draws numbers."""
        return triangular_between(self.triangular.min, self.triangular.mode, self.triangular.max)


Draw = Normal | Lognormal | PowerLaw | Uniform | Weibull | Triangular

KINDS: dict[str, type[StrictModel]] = {
    "[normal]": Normal, "[lognormal]": Lognormal, "[power_law]": PowerLaw, "[uniform]": Uniform, "[weibull]": Weibull,
    "[triangular]": Triangular,
}  # fmt: skip
"""The forms of random numbers in a scene, by the mark that pydantic adds to key paths in its errors."""
NUMBER = "[number]"
MEASURED = "[measured]"
MARKS = (*KINDS, MEASURED, NUMBER)


def distribution_of(value: float | Draw) -> Distribution:
    """Return the distribution from which a run draws, for a fixed or a random number of a scene."""
    return fixed(float(value)) if isinstance(value, int | float) else value.prepared


def drawn(unit: str, further: Mapping[str, type[StrictModel]] = MappingProxyType({}), **limits: float) -> Any:
    """Return the type of a scene field whose value is a number or a distribution within limits.

    A mark is the name in brackets with which pydantic selects the type of a value, such as `[uniform]`.

    unit : unit of the numbers, for messages
    further : types, by mark, that the value may have in addition to KINDS; these types check their own limits
    limits : limits of all numbers that can be drawn, by pydantic's names ge, gt, le and lt
    """
    kinds = {**KINDS, **further}
    number = Annotated[Number, Field(**limits)]
    union = reduce(or_, (Annotated[kind, Tag(mark)] for mark, kind in kinds.items()), Annotated[number, Tag(NUMBER)])
    mark = Discriminator(lambda value: _kind_of(kinds, value))
    return Annotated[union, mark, AfterValidator(partial(_within, limits, unit))]


def _kind_of(kinds: Mapping[str, type[StrictModel]], value: Any) -> str:
    """Return the mark, such as `[uniform]`, by which pydantic selects the type of a value; see `drawn`.

    A mapping that names no type in `kinds` counts as a normal distribution. Any other value that is not an object of a
    type in `kinds` counts as a plain number.
    kinds : types that the value may have, by mark
    """
    if isinstance(value, Mapping):
        return next((f"[{name}]" for name in value if f"[{name}]" in kinds and name != "normal"), "[normal]")
    return next((mark for mark, kind in kinds.items() if type(value) is kind), NUMBER)


def _within(limits: Mapping[str, float], unit: str, value: Any) -> Any:
    """Return the value unchanged; raise a PydanticCustomError for a distribution that may give a number out of limits.

    Only distributions are checked here: pydantic checks plain numbers, and further types check themselves.
    limits : limits by pydantic's names ge, gt, le, lt; unit : unit of the numbers, for the message
    """
    if not isinstance(value, Draw):
        return value
    low, high = (value.min, value.max) if isinstance(value, Normal) else value.bounds
    least, most = limits.get("ge", limits.get("gt")), limits.get("le", limits.get("lt"))
    below = least is not None and (low < least or ("gt" in limits and low == least))
    above = most is not None and (high > most or ("lt" in limits and high == most))
    if below or above:
        bounds = [f"{word} {limits[key]:g}" for key, word in WORDS.items() if key in limits]
        raise refuse(f"may be drawn from {low:g} to {high:g}, but must be {' and '.join(bounds)} {unit}".rstrip())
    return value


WORDS = {"ge": "at least", "gt": "above", "le": "at most", "lt": "below"}
"""Words for the limits of a number in messages, by pydantic's names of the limits."""


def rising(low: float, high: float) -> None:
    """Raise a PydanticCustomError for the key `min` unless the lower bound of a distribution is below the upper one."""
    if low >= high:
        raise refuse(f"is {low:g}, but must be a number below max {high:g}", "min")


if TYPE_CHECKING:
    Share = float | Draw
    FrictionAngle = float | Draw
    Coefficient = float | Draw
    Speed = float | Draw
else:
    Share = drawn("(-)", ge=0, le=1)
    FrictionAngle = drawn("(degrees)", ge=0, lt=90)
    Coefficient = drawn("(-)", ge=0)
    Speed = drawn("(m/s)", ge=0)
