"""Choose from a measured price list: the largest error of a scene, and the cheapest setting within a target."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.accuracy.price_list import EVENTS, Priced, PriceList
from rpf3d_core.errors import InputError
from rpf3d_core.scene.method import MethodSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene

MOST_ROCKS = 10_000_000
"""Largest number of rocks that may be chosen; equal to the default of a scene's `target.most_rocks`."""


def check_target(target: float) -> None:
    """Raise an error if a target (-) for the total error of a setting is not a number above 0 and below 1.

    Raises
    ------
    InputError
        The target is 0 or less, 1 or more, or NaN.
    """
    if not 0.0 < target < 1.0:
        raise InputError(f"the accuracy is {target:g}; it must be a number above 0 and below 1, an error of the map")


class Choice(NamedTuple):
    """A setting that a user could choose, with its errors and its cost.

    method : method of finding contacts; terrain : full or coarser mesh; both as names and values (`Priced.setting`)
    rocks : number of rocks
    numerical, geometric, statistical : the three errors (-) of the setting
    seconds : computing time of all rocks, s of one core
    """

    method: Mapping[str, Any]
    terrain: Mapping[str, Any]
    rocks: int
    numerical: float
    geometric: float
    statistical: float
    seconds: float

    @property
    def total(self) -> float:
        """The total error (-): the sum of the three errors, because a bias and a random error do not cancel."""
        return self.numerical + self.geometric + self.statistical


def errors_of_scene(prices: PriceList) -> dict[str, float]:
    """Return the errors (-) of a scene with its own settings, by name.

    The names are numerical, geometric, statistical and parametric. The geometric error is that of a terrain with half
    of the triangles, because the error of the survey itself cannot be measured; 0 if no such terrain was measured.
    Without unknowns in the scene, the result has no key `parametric`: the parametric error is then not known.
    """
    halves = [line.error for line in prices.geometric if line.setting["part"] == 2]
    return {
        "numerical": _of(prices.numerical, prices.method).error,
        "geometric": halves[0] if halves else 0.0,
        "statistical": statistical_error(prices.statistical, prices.rocks),
        **({"parametric": prices.parametric[0].error} if prices.parametric else {}),
    }


def largest(prices: PriceList) -> str | None:
    """Return the name of the largest known error of a scene, the error to reduce first; None if all errors are 0."""
    errors = errors_of_scene(prices)
    name = max(errors, key=lambda name: errors[name])
    return name if errors[name] > 0.0 else None


def cheapest(prices: PriceList, target: float) -> Choice | None:
    """Return the setting that meets a target in the shortest computing time; None if no setting meets the target.

    Every measured method is combined with every measured terrain, and each combination with the number of rocks that
    meets the target (`rocks_needed`). Rasters are excluded, because a scene cannot request a raster.

    target : largest total error (-)
    """
    found = [
        choice
        for method in prices.numerical
        if method.setting["method"] != "raster"
        for terrain in prices.geometric
        if (choice := _chosen(prices, method, terrain, target)) is not None
    ]
    return min(found, key=lambda choice: choice.seconds, default=None)


def cheapest_by_events(prices: PriceList, target: float) -> Choice | None:
    """Return the setting with exact contacts, the full terrain and a number of rocks that meets a target.

    The number of rocks is that of `rocks_needed`. For rocks with a shape, the setting has the scene's own accuracy of
    contact. Return None if no number of rocks meets the target. A run with `--accuracy` uses this setting.

    target : largest total error (-)
    """
    of_bodies = prices.method["method"] == "contact"
    return _chosen(prices, _of(prices.numerical, prices.method if of_bodies else EVENTS), _whole(prices), target)


def exact_run(scene: str | Path, prices: PriceList, target: float) -> tuple[Scene, int]:
    """Return the scene with exact contacts in place of fixed steps, and the number of rocks that meets a target.

    scene : scene file; prices : price list of this scene; target : largest total error (-)

    Raises
    ------
    InputError
        The scene is invalid, or no number of rocks up to MOST_ROCKS (10 million) is enough.
    """
    choice = cheapest_by_events(prices, target)
    if choice is None:
        raise InputError(f"{scene}: an accuracy of {target:g} takes more than {MOST_ROCKS:,} rocks; ask for less")
    return read_scene(scene).model_copy(update={"method": MethodSpec()}), choice.rocks


def _chosen(prices: PriceList, method: Priced, terrain: Priced, target: float) -> Choice | None:
    rocks = rocks_needed(prices.statistical, target - method.error - terrain.error)
    if rocks is None:
        return None
    factor = terrain.seconds_per_1000_rocks / max(_whole(prices).seconds_per_1000_rocks, 1e-12)
    seconds = method.seconds_per_1000_rocks * factor * rocks / 1000.0
    statistical = statistical_error(prices.statistical, rocks)
    return Choice(
        method=method.setting,
        terrain=terrain.setting,
        rocks=rocks,
        numerical=method.error,
        geometric=terrain.error,
        statistical=statistical,
        seconds=seconds,
    )


def statistical_error(lines: Sequence[Priced], rocks: int) -> float:
    """Return the statistical error (-) of a result from a number of rocks, at most 1.

    The error is that of the nearest measured number of rocks, scaled by 1 / sqrt(rocks).

    lines : the statistical lines of a price list, each for one measured number of rocks
    """
    nearest = min(lines, key=lambda line: abs(math.log(line.setting["rocks"] / rocks)))
    return min(nearest.error * math.sqrt(nearest.setting["rocks"] / rocks), 1.0)


def rocks_needed(lines: Sequence[Priced], allowed: float) -> int | None:
    """Return the smallest measured number of rocks whose statistical error is at most `allowed` (-).

    If there is none, return an extrapolation from the largest measured number: errors are proportional to
    1 / sqrt(rocks). Return None if the extrapolation is above MOST_ROCKS (10 million), or if `allowed` is not above 0.

    lines : the statistical lines of a price list, by ascending number of rocks
    """
    if allowed <= 0.0:
        return None
    for line in lines:
        if line.error <= allowed:
            return int(line.setting["rocks"])
    last = lines[-1]
    rocks = math.ceil(last.setting["rocks"] * (last.error / allowed) ** 2)
    return rocks if rocks <= MOST_ROCKS else None


def _of(lines: Sequence[Priced], setting: Mapping[str, Any]) -> Priced:
    return next(line for line in lines if dict(line.setting) == dict(setting))


def _whole(prices: PriceList) -> Priced:
    return next(line for line in prices.geometric if line.setting["part"] == 1)
