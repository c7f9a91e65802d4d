"""Unknown values of a scene: priors of coefficients, and samples of parameter sets, such as those of a calibration.

An unknown has one value for the whole site, but the value is not known: each parameter set of a run has another value.
A value from a distribution (`scene.draws`) is something else: such a value varies from rock to rock, or from impact to
impact.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Self

from pydantic import Field, ValidationError, model_validator

from rpf3d_core.materials.distributions import Distribution, truncated_normal, uniform_between
from rpf3d_core.scene.draws import rising
from rpf3d_core.scene.models.own import OWN, is_own
from rpf3d_core.scene.values import Count, InputFile, Number, StrictModel, refuse

PRIOR = "prior"
"""Key that marks a value of a scene as an unknown."""
ROOTS = ("materials", "rebound", "ground", "contact", "effects", "stop_speed")
"""Keys of a scene below which a value may be an unknown."""
FEWEST_SETS, MOST_SETS = 40, 4096
"""Smallest and largest number of parameter sets of a run.

A 95 % predictive interval needs the results of at least 39 sets (`unknowns.predictive.ENOUGH`).
"""
FORMS = "{min, max} or {mean, sd, min, max}"


class PriorSpec(StrictModel):
    """What is known about an unknown before any calibration: a range, or a normal distribution within a range."""

    min: Number = Field(description="a number below max, the smallest value that is possible")
    max: Number = Field(description="a number above min, the largest value that is possible")
    mean: Number | None = Field(None, description="a number from min to max; left out: all values are equally probable")
    sd: Number | None = Field(None, gt=0, description="a number above 0, the standard deviation; goes with mean")

    @model_validator(mode="after")
    def _normal_or_uniform(self) -> Self:
        rising(self.min, self.max)
        if (self.mean is None) != (self.sd is None):
            raise refuse(f"must be {FORMS}: mean and sd go together")
        if self.mean is not None and not self.min <= self.mean <= self.max:
            raise refuse(f"is {self.mean:g}, but must lie between min {self.min:g} and max {self.max:g}", "mean")
        return self

    @property
    def distribution(self) -> Distribution:
        """The distribution from which the values of the parameter sets are drawn."""
        if self.mean is None or self.sd is None:
            return uniform_between(self.min, self.max)
        return truncated_normal(self.mean, self.sd, self.min, self.max)

    def describe(self) -> str:
        """Return the prior in words, such as "0.2 to 0.6" or "0.2 to 0.6, mean 0.4, sd 0.1"."""
        normal = "" if self.mean is None else f", mean {self.mean:g}, sd {self.sd:g}"
        return f"{self.min:g} to {self.max:g}{normal}"

    @property
    def middle(self) -> float:
        """The number that stands for the unknown in a scene: the mean if there is one, else the middle of the range."""
        return self.mean if self.mean is not None else 0.5 * (self.min + self.max)


class UnknownsSpec(StrictModel):
    """The unknowns of a run, and the number of parameter sets among which the rocks of the run are divided."""

    sets: Count = Field(
        64, ge=FEWEST_SETS, le=MOST_SETS, description=f"a whole number from {FEWEST_SETS} to {MOST_SETS}, the "
        "number of parameter sets; `rocks` is the total over all of them",
    )  # fmt: skip
    priors: Mapping[str, PriorSpec] = Field(
        default_factory=dict, description="a mapping of key paths such as materials.*.friction to {min, max} or "
        "{mean, sd, min, max}",
    )  # fmt: skip
    sample: InputFile | None = Field(
        None, description="the path of a Parquet file with parameter sets, such as posterior.parquet of a calibration: "
        "a column for each key path; `weight` is optional",
    )  # fmt: skip
    misfit: Number | None = Field(
        None, ge=0, description="a length (m) >= 0, the misfit of the model (see the glossary), which a calibration "
        "estimates; predictive intervals include it",
    )  # fmt: skip

    @property
    def names_any(self) -> bool:
        """True if a value of the scene is unknown."""
        return bool(self.priors) or self.sample is not None

    def describe(self, idle: Sequence[str] = ()) -> str:
        """Return the unknowns in words for `rpf3d check`, such as "64 parameter sets of materials.*.friction".

        idle : names of materials that no surface of the terrain has; their own unknowns are left out
        """
        sources = [f"the sample {self.sample.name}"] if self.sample is not None else []
        left_out = tuple(f"materials.{name}." for name in idle if name != "*")  # `materials.*` is of all materials
        shown = [path for path in self.priors if not path.startswith(left_out)]
        return f"{self.sets} parameter sets of {', '.join([*sources, *shown]) or 'materials that no surface has'}"


def with_priors_apart(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the values of a scene in which a number replaces each `{prior: ...}`, and `unknowns` contains the priors.

    The number is the middle of the prior (`PriorSpec.middle`).

    Raises
    ------
    PydanticCustomError
        A prior is wrong, or is next to another key; the error names the key.
    """
    roots, found = dict[str, Any](), dict[str, PriorSpec]()
    for root in ROOTS:
        if root in values and any(True for _ in _priors_in(values[root], (root,))):
            found |= dict(_priors_in(values[root], (root,)))
            roots[root] = _middles_in(values[root], (root,))
    if not found:
        return values
    given = values.get("unknowns") or {}
    if isinstance(given, UnknownsSpec):
        return {**values, **roots, "unknowns": given.model_copy(update={"priors": {**given.priors, **found}})}
    if not isinstance(given, Mapping):
        return values
    return {**values, **roots, "unknowns": {**given, "priors": {**(given.get("priors") or {}), **found}}}


def _priors_in(value: Any, path: tuple[str, ...]) -> Iterator[tuple[str, PriorSpec]]:
    """Yield the key path and the prior of each `{prior: ...}` in a value of a scene; path : keys to the value."""
    if not isinstance(value, Mapping):
        return
    if _is_prior(value, path):
        yield ".".join(path), _prior(value, path)
        return
    for key, inner in value.items():
        yield from _priors_in(inner, (*path, str(key)))


def _is_prior(value: Mapping[str, Any], path: tuple[str, ...]) -> bool:
    """Return True if a mapping in a scene is `{prior: ...}`; path : the keys that lead to the mapping.

    The mapping of a user's own class to its parameters is not, although a parameter may have the name `prior`.
    """
    own = path[0] in ("rebound", "effects") and (path[1:] == (OWN, "values") or (len(path) == 2 and is_own(path[1])))
    return PRIOR in value and not own


def _prior(value: Mapping[str, Any], path: tuple[str, ...]) -> PriorSpec:
    """Return the prior of a value `{prior: ...}`; raise a PydanticCustomError if it is wrong.

    path : the keys that lead to the value, for the error
    """
    if set(value) != {PRIOR}:
        other = next(key for key in value if key != PRIOR)
        raise refuse("cannot stand next to `prior`; a value is unknown, or varies, or its mean is unknown: "
                     "{mean: {prior: ...}, sd, min, max}", *path, other)  # fmt: skip
    try:
        return PriorSpec.model_validate(value[PRIOR])
    except ValidationError as error:
        detail = error.errors()[0]
        sentence, at = _sentence(detail)
        raise refuse(sentence, *path, PRIOR, *at) from None


def _sentence(detail: Any) -> tuple[str, tuple[str | int, ...]]:
    """Return why a prior is wrong, as a sentence, and the path of the wrong key below `prior`."""
    context = detail.get("ctx", {})
    if "sentence" in context:
        return context["sentence"], (*detail["loc"], *context["at"])
    if detail["type"] == "missing":
        return f"must be {FORMS}, but has no {detail['loc'][-1]}", ()
    return f"must be {FORMS}, but {'.'.join(map(str, detail['loc'])) or 'it'} is wrong", ()


def _middles_in(value: Any, path: tuple[str, ...]) -> Any:
    """Return a value of a scene with the middle of each prior in place of `{prior: ...}`; path : keys to the value.

    Each `{prior: ...}` is one that `_priors_in` yields.
    """
    if not isinstance(value, Mapping):
        return value
    if _is_prior(value, path):
        return _prior(value, path).middle
    return {key: _middles_in(inner, (*path, str(key))) for key, inner in value.items()}
