"""The contents of a site file: the limits of each level in each area, the age limits of evidence, and the alarm.

Each mine chooses its own thresholds in its trigger action response plan (docs/explanation/alerts.md). So the limits of
areas, the age limits of sources and terrain, `clock_tolerance_s`, `fewest_rocks`, `most_unfinished`, `valid_s` and
`alarm_from` have no default. A level without limits is never reached.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95, wilson_interval
from rpf3d_core.scene.values import Count, Name, Number, StrictModel, refuse

LONGEST = 1e9
"""Longest period (s), about 31 years. Sums of such periods in nanoseconds still fit into 64 bits."""

PATTERN_MARKS = "*?["
"""Characters that make a pattern of the name of an area in the site file."""

LEVELS = ("watch", "restrict", "evacuate")
"""The alert levels for which an area may have limits, the lowest level first."""

Seconds = Annotated[Number, Field(ge=0, le=LONGEST)]
Period = Annotated[Number, Field(gt=0, le=LONGEST)]
Share = Annotated[Number, Field(gt=0, le=1)]

LEAST_ROCKS = 40
"""Smallest allowed `fewest_rocks`: if none of 40 rocks reaches an area, the 95 % interval of the share ends at 9 %."""


class EvacuationSpec(StrictModel):
    """The limit on the first arrival of a rock: `evacuation` (s) plus `margin` (s)."""

    evacuation: Seconds = Field(description="a number >= 0 (s), the time that people need to leave the area")
    margin: Seconds = Field(description="a number >= 0 (s), the time until people receive the alert and start to act")

    @property
    def seconds(self) -> float:
        """Limit of the first arrival (s): if a rock arrives at this time or earlier, the area cannot be evacuated."""
        return self.evacuation + self.margin


class LimitsSpec(StrictModel):
    """The limits of one level in an area; the level is reached if the rocks in the area reach at least one limit."""

    reach_probability: Share | None = Field(None, description="a share above 0 and below 1 (-) of all rocks flown")
    p95_energy_j: Number | None = Field(
        None, gt=0, description="a number above 0 (J), the p95 energy of the rocks that reached the area"
    )
    first_arrival_s: EvacuationSpec | None = Field(
        None,
        description="a mapping {evacuation, margin} (s); reached if the first rock arrives at most their sum after its "
        "release",
    )

    @model_validator(mode="after")
    def _at_least_one(self) -> Self:
        if self.reach_probability is None and self.p95_energy_j is None and self.first_arrival_s is None:
            raise refuse("has no limit; give one or more of reach_probability, p95_energy_j, first_arrival_s")
        return self


class AreaLimitsSpec(StrictModel):
    """The limits of one area, or of all areas whose names match a pattern."""

    watch: LimitsSpec | None = Field(None, description="a mapping of limits; without it, this level is never reached")
    restrict: LimitsSpec | None = Field(
        None, description="a mapping of limits; without it, this level is never reached"
    )
    evacuate: LimitsSpec | None = Field(
        None, description="a mapping of limits; without it, this level is never reached"
    )

    @model_validator(mode="after")
    def _graded(self) -> Self:
        given = [(level, limits) for level in LEVELS if (limits := getattr(self, level)) is not None]
        if not given:
            raise refuse(f"names no level; give one or more of {', '.join(LEVELS)}")
        for (lower, below), (higher, above) in combinations(given, 2):
            for key, (low, high) in _pairs(below, above).items():
                if low is not None and high is not None and low > high:
                    raise refuse(_disorder(key, lower, higher), higher, key)
        return self


def _pairs(below: LimitsSpec, above: LimitsSpec) -> dict[str, tuple[float | None, float | None]]:
    """Return each limit of a lower and a higher alert level as a pair, by key, to check their order.

    In every pair, the second number must not be smaller than the first; for this, limits of the first arrival are
    negated. A limit that a level does not have is None.
    """
    early, late = below.first_arrival_s, above.first_arrival_s
    return {
        "reach_probability": (below.reach_probability, above.reach_probability),
        "p95_energy_j": (below.p95_energy_j, above.p95_energy_j),
        "first_arrival_s": (-early.seconds if early else None, -late.seconds if late else None),
    }


def _disorder(key: str, lower: str, higher: str) -> str:
    rule = "longer than" if key == "first_arrival_s" else "below"
    return f"is {rule} that of {lower}, so {lower} would never be seen before {higher}"


class EvidenceSpec(StrictModel):
    """Rules for evidence: when evidence is a fault, when an answer is too small, and which figures limits apply to."""

    sources_max_age_s: Period = Field(
        description="a number above 0 (s), the greatest age of sources; older sources are a fault"
    )
    terrain_max_age_s: Period = Field(
        description="a number above 0 (s), the greatest age of the survey; an older survey is a fault"
    )
    clock_tolerance_s: Seconds = Field(
        description="a number >= 0 (s), the time by which a stamp may be ahead of the clock; more is a fault"
    )
    fewest_rocks: Annotated[Count, Field(ge=1)] = Field(
        description="a whole number of at least 1; an answer with fewer rocks may raise a level, but cannot lower one"
    )
    most_unfinished: Annotated[Number, Field(ge=0, le=1)] = Field(
        description="a share from 0 to 1 (-) of rocks whose flight was cut off; a larger share is a fault"
    )
    most_left: Annotated[Number, Field(ge=0, le=1)] = Field(
        0.01,
        description="a share from 0 to 1 (-) of rocks that left the terrain and may still reach an area; a larger "
        "share is a fault",
    )
    most_uncovered: Annotated[Number, Field(ge=0, le=1)] = Field(
        0.05, description="a share from 0 to 1 (-) of an area that has no terrain; a larger share is a fault"
    )
    cluster_m: Annotated[Number, Field(ge=0, le=LONGEST)] = Field(
        10.0,
        description="a number >= 0 (m), the side of squares; the rocks of all sources in one square are counted "
        "together; 0: the rocks of each source are counted separately",
    )
    moved_area_s: Seconds = Field(
        2.0,
        description="a number >= 0 (s), the time after the move of an area until all sources must be answered for its "
        "new place; a longer time is a fault",
    )
    changed_terrain_s: Seconds = Field(
        5.0,
        description="a number >= 0 (s), the time after a change of the terrain until all sources must be answered over "
        "the new terrain; a longer time is a fault",
    )
    scan_period_s: Seconds | None = Field(
        None,
        description="a number >= 0 (s), the time within which a sensor reports every place again; 0: each message has "
        "all places. Without it, a dangerous place that its sensor no longer reports is a fault",
    )
    interval: Literal["predictive", "sampling"] = Field(
        "predictive",
        description="predictive or sampling, the interval that is compared if the scene has unknowns; predictive also "
        "covers the unknown ground, sampling covers only the number of rocks",
    )
    reach_probability_is: Literal["upper_end", "share"] = Field(
        "upper_end",
        description="upper_end or share, the figure that is compared with reach_probability: the upper end of the 95 % "
        "interval of the share, or the share itself",
    )


class AcknowledgeSpec(StrictModel):
    """How many persons must acknowledge before a level falls."""

    persons: Annotated[Count, Field(ge=1, le=2)] = Field(
        1, description="1 or 2, the number of persons who must acknowledge before a level falls"
    )
    held_from: Literal["watch", "restrict", "evacuate"] = Field(
        "watch",
        description="watch, restrict or evacuate, the lowest held level that needs `persons`; lower levels need one",
    )
    within_s: Period = Field(
        300.0, description="a number above 0 (s), the time within which the second person must acknowledge"
    )


def _named_areas(areas: Mapping[str, AreaLimitsSpec]) -> Mapping[str, AreaLimitsSpec]:
    if not areas:
        raise refuse("has no area; name at least one, with its limits")
    if "" in areas:
        raise refuse("has an area without a name")
    return areas


class Thresholds(StrictModel):
    """The contents of a site file: all settings of the site for alerts and for the evidence."""

    site: Name = Field(description="the name of the site in the decision log")
    evidence: EvidenceSpec = Field(description="a mapping, the rules for evidence")
    valid_s: Period = Field(description="a number above 0 (s), how long a decision is valid")
    alarm_from: Literal["watch", "restrict", "evacuate"] = Field(
        description="watch, restrict or evacuate, the lowest held level that raises the alarm; a fault always raises it"
    )
    acknowledge: AcknowledgeSpec = Field(
        AcknowledgeSpec(), description="a mapping, the persons who must acknowledge; without it, one person"
    )
    areas: Annotated[Mapping[str, AreaLimitsSpec], AfterValidator(_named_areas)] = Field(
        description="a mapping from the name of an area, or a pattern of names (*, ? or [...]), to its limits"
    )

    @property
    def named_in_full(self) -> tuple[str, ...]:
        """Names of areas that every answer must contain: full names only, because a pattern may match no area."""
        return tuple(name for name in self.areas if not any(mark in name for mark in PATTERN_MARKS))

    @model_validator(mode="after")
    def _enough_rocks(self) -> Self:
        """Refuse a `fewest_rocks` that is so small that a limit may be exceeded although no rock reaches the area.

        With so few rocks, the upper end of the interval of the share is above the limit. If limits are compared with
        this end, the level is held without reason; if they are compared with the share, the level may be too low.

        A `fewest_rocks` below LEAST_ROCKS (40) is refused whatever the limits are: limits of energy and arrival do not
        help if dangerous rocks are too rare to be simulated at all.
        """
        fewest, lowest = self.evidence.fewest_rocks, min(self._shares(), default=None)
        if lowest and wilson_interval(0, fewest)[1] >= lowest[0]:
            raise refuse(_too_few(fewest, *lowest), "evidence", "fewest_rocks")
        if fewest < LEAST_ROCKS:
            raise refuse(
                f"is {fewest}, but must be at least {LEAST_ROCKS}: if none of {fewest} rocks reaches an area, up to "
                f"{100 * wilson_interval(0, fewest)[1]:.3g} % of the rocks may still reach it, with any energy",
                "evidence", "fewest_rocks",
            )  # fmt: skip
        return self

    def _shares(self) -> Iterator[tuple[float, str]]:
        """Yield every limit of the reach probability with its key, for the check of `fewest_rocks`."""
        for name, area in self.areas.items():
            for level in LEVELS:
                limits: LimitsSpec | None = getattr(area, level)
                if limits is not None and limits.reach_probability is not None:
                    yield limits.reach_probability, f"areas.{name}.{level}"


def _too_few(fewest: int, limit: float, where: str) -> str:
    """Return the error message for a `fewest_rocks` that is too small, with the smallest number that would be right.

    limit : the lowest limit of the reach probability (-); where : its key in the site file

    If none of n rocks reaches the area, the 95 % Wilson interval of the share ends at z^2 / (n + z^2), with z = 1.96.
    """
    needed = max(math.floor(NORMAL_QUANTILE_95**2 * (1.0 / limit - 1.0)) + 1, LEAST_ROCKS)
    return (
        f"is {fewest}; if none of {fewest} rocks reaches the area, the interval of the share still ends at "
        f"{100 * wilson_interval(0, fewest)[1]:.3g} %, and the limit of `{where}` is {100 * limit:.3g} %: give at "
        f"least {needed}"
    )
