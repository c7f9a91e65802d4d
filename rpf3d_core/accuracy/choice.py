"""Reading the price list: which of the three errors is the largest, and the cheapest setting within a target."""

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
"""Where to give up: as `target.most_rocks` of a scene."""


def check_target(target: float) -> None:
    """Refuse what no total of errors (-) could keep to.

    Raises
    ------
    InputError
        It is not between 0 and 1.
    """
    if not 0.0 < target < 1.0:
        raise InputError(f"the accuracy is {target:g}; it must be a number above 0 and below 1, an error of the map")


class Choice(NamedTuple):
    """A setting: how contacts are found, over which terrain, with how many rocks.

    numerical, geometric, statistical : its errors (-); seconds : of one core
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
        """The three errors added up (-): a bias and an interval do not cancel."""
        return self.numerical + self.geometric + self.statistical


def errors_of_scene(prices: PriceList) -> dict[str, float]:
    """The three errors (-) of a scene as it stands: its method, half of its triangles, and its number of rocks.

    Nobody knows what its survey misses; what half of it misses is the nearest that can be measured.
    """
    halves = [line.error for line in prices.geometric if line.setting["part"] == 2]
    return {
        "numerical": _of(prices.numerical, prices.method).error,
        "geometric": halves[0] if halves else 0.0,
        "statistical": statistical_error(prices.statistical, prices.rocks),
    }


def largest(prices: PriceList) -> str | None:
    """The name of the largest of the three errors of a scene; None where all are 0."""
    errors = errors_of_scene(prices)
    name = max(errors, key=lambda name: errors[name])
    return name if errors[name] > 0.0 else None


def cheapest(prices: PriceList, target: float) -> Choice | None:
    """Of all ways to find contacts and all terrains measured, with as many rocks as each then needs; None if none does.

    Rasters are left out, for no scene can ask for one.

    target : what the total (-) must keep to
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
    """The fewest rocks that keep the total under a target (-) by events, over the terrain as it is: what a run does."""
    return _chosen(prices, _of(prices.numerical, EVENTS), _whole(prices), target)


def exact_run(scene: str | Path, prices: PriceList, target: float) -> tuple[Scene, int]:
    """A scene, its contacts found by events, and the rocks to fly for a target (-).

    Raises
    ------
    InputError
        The scene is refused, or no number of rocks up to MOST_ROCKS is enough.
    """
    choice = cheapest_by_events(prices, target)
    if choice is None:
        raise InputError(f"{scene}: an accuracy of {target:g} takes more than {MOST_ROCKS:,} rocks; ask for less")
    return read_scene(scene).model_copy(update={"method": MethodSpec()}), choice.rocks


def _chosen(prices: PriceList, method: Priced, terrain: Priced, target: float) -> Choice | None:
    rocks = rocks_needed(prices.statistical, target - method.error - terrain.error)
    if rocks is None:
        return None
    dearer = terrain.seconds_per_1000_rocks / max(_whole(prices).seconds_per_1000_rocks, 1e-12)
    seconds = method.seconds_per_1000_rocks * dearer * rocks / 1000.0
    statistical = statistical_error(prices.statistical, rocks)
    return Choice(method.setting, terrain.setting, rocks, method.error, terrain.error, statistical, seconds)


def statistical_error(lines: Sequence[Priced], rocks: int) -> float:
    """The error (-) of so many rocks: of the measured number nearest to it, and from there as 1 / sqrt(rocks)."""
    nearest = min(lines, key=lambda line: abs(math.log(line.setting["rocks"] / rocks)))
    return min(nearest.error * math.sqrt(nearest.setting["rocks"] / rocks), 1.0)


def rocks_needed(lines: Sequence[Priced], allowed: float) -> int | None:
    """The smallest measured number of rocks with an error up to `allowed` (-), or what the last one promises.

    Errors go as 1 / sqrt(rocks), so from the last one on it is told how many more it takes; None beyond MOST_ROCKS.
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
