"""Numbers in a scene that may be random: a fixed number, or one of four truncated distributions."""

from collections.abc import Mapping
from functools import partial, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from rpf3d_core.materials.distributions import (
    Distribution,
    fixed,
    truncated_lognormal,
    truncated_normal,
    truncated_power_law,
    uniform_between,
)
from rpf3d_core.scene.values import Number, StrictModel, refuse


class Normal(StrictModel):
    """A normal distribution, cut off at its bounds; the scene file contains {mean, sd, min, max} without a name."""

    mean: Number = Field(description="a number from min to max, the mean before the cut")
    sd: Number = Field(ge=0, description="a number >= 0, the standard deviation before the cut")
    min: Number = Field(description="a number below max; nothing below it is drawn")
    max: Number = Field(description="a number above min; nothing above it is drawn")

    @model_validator(mode="before")
    @classmethod
    def _without_a_name(cls, values: Any) -> Any:
        if isinstance(values, Mapping) and "normal" in values:
            raise refuse("is not a key: a normal distribution is written {mean, sd, min, max}", "normal")
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
        """The distribution in the form from which the flight loops draw."""
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
        """The distribution in the form from which the flight loops draw."""
        return truncated_lognormal(self.mean, self.sd, self.min, self.max)


class PowerLawSpec(StrictModel):
    """A truncated power law, N(> x) ~ x^-exponent between two bounds.

    Physics reference 6.4: volumes of blocks have exponents of 0.4 to 0.6.
    """

    exponent: Number = Field(gt=0, description="a number above 0, b in N(> x) ~ x^-b")
    min: Number = Field(gt=0, description="a number above 0 and below max")
    max: Number = Field(gt=0, description="a number above min")

    @model_validator(mode="after")
    def _bounds_rise(self) -> Self:
        rising(self.min, self.max)
        return self

    @property
    def prepared(self) -> Distribution:
        """The distribution in the form from which the flight loops draw."""
        return truncated_power_law(self.exponent, self.min, self.max)


class Lognormal(StrictModel):
    """A lognormal distribution, cut off at its bounds."""

    lognormal: LognormalSpec = Field(description="a mapping with mean, sd, min and max")

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number that can be drawn."""
        return self.lognormal.min, self.lognormal.max

    @property
    def prepared(self) -> Distribution:
        """The distribution in the form from which the flight loops draw."""
        return self.lognormal.prepared


class PowerLaw(StrictModel):
    """A truncated power law."""

    power_law: PowerLawSpec = Field(description="a mapping with exponent, min and max")

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number that can be drawn."""
        return self.power_law.min, self.power_law.max

    @property
    def prepared(self) -> Distribution:
        """The distribution in the form from which the flight loops draw."""
        return self.power_law.prepared


class Uniform(StrictModel):
    """A uniform distribution between two bounds."""

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
        """The distribution in the form from which the flight loops draw."""
        return uniform_between(*self.uniform)


Draw = Normal | Lognormal | PowerLaw | Uniform

KINDS: dict[str, type[StrictModel]] = {
    "[normal]": Normal, "[lognormal]": Lognormal, "[power_law]": PowerLaw, "[uniform]": Uniform,
}  # fmt: skip
"""The distributions that a scene may use, by the mark that names each in key paths of pydantic."""
NUMBER = "[number]"
MARKS = (*KINDS, NUMBER)


def distribution_of(value: float | Draw) -> Distribution:
    """Return the distribution for a value of a scene (number or distribution), from which the flight loops draw."""
    return fixed(float(value)) if isinstance(value, int | float) else value.prepared


def drawn(unit: str, **limits: float) -> Any:
    """Return the type of a scene field that takes a number or a distribution within limits (ge, gt, le, lt)."""
    number = Annotated[Number, Field(**limits)]
    kinds = [Annotated[kind, Tag(mark)] for mark, kind in KINDS.items()]
    union = reduce(or_, kinds, Annotated[number, Tag(NUMBER)])
    return Annotated[union, Discriminator(_kind_of), AfterValidator(partial(_within, limits, unit))]


def _kind_of(value: Any) -> str:
    """Return the mark of a value's type: a named distribution, normal (any other mapping), or a number."""
    if isinstance(value, Mapping):
        return next((f"[{name}]" for name in value if f"[{name}]" in KINDS and name != "normal"), "[normal]")
    return next((mark for mark, kind in KINDS.items() if type(value) is kind), NUMBER)


def _within(limits: Mapping[str, float], unit: str, value: float | Draw) -> float | Draw:
    """Return the value unchanged, after a check that a distribution cannot give a number outside the limits."""
    if isinstance(value, float):
        return value
    low, high = (value.min, value.max) if isinstance(value, Normal) else value.bounds
    least, most = limits.get("ge", limits.get("gt")), limits.get("le", limits.get("lt"))
    below = least is not None and (low < least or ("gt" in limits and low == least))
    above = most is not None and (high > most or ("lt" in limits and high == most))
    if below or above:
        said = [f"{word} {limits[key]:g}" for key, word in WORDS.items() if key in limits]
        raise refuse(f"may be drawn from {low:g} to {high:g}, but must be {' and '.join(said)} {unit}".rstrip())
    return value


WORDS = {"ge": "at least", "gt": "above", "le": "at most", "lt": "below"}
"""Words for the limits of a number, for messages."""


def rising(low: float, high: float) -> None:
    """Raise an error unless the lower bound of a distribution is below its upper bound."""
    if low >= high:
        raise refuse(f"is {low:g}, but must be a number below max {high:g}", "min")


if TYPE_CHECKING:
    Size = float | Draw
    Share = float | Draw
    FrictionAngle = float | Draw
    Coefficient = float | Draw
    Speed = float | Draw
else:
    Size = drawn("", gt=0)
    Share = drawn("(-)", ge=0, le=1)
    FrictionAngle = drawn("(degrees)", ge=0, lt=90)
    Coefficient = drawn("(-)", ge=0)
    Speed = drawn("(m/s)", ge=0)
