"""The price list as series of points to be drawn: error against seconds of one core."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rpf3d_core.accuracy.price_list import Priced, PriceList


class Series(NamedTuple):
    """Points of one kind: seconds (S,), errors (S,) (-), and a word for each."""

    name: str
    kind: str
    seconds: Sequence[float]
    errors: Sequence[float]
    words: Sequence[str]


def series_of(prices: PriceList) -> list[Series]:
    """All series; seconds are those of 1,000 rocks or, where the number of rocks is the setting, of that many."""
    groups: dict[str, list[Priced]] = {}
    for line in prices.numerical:
        groups.setdefault(_method_name(line.setting), []).append(line)
    return [
        *(_series(name, "numerical", lines) for name, lines in groups.items()),
        _series("fewer triangles", "geometric", [line for line in prices.geometric if line.setting["part"] > 1]),
        _series("number of rocks", "statistical", prices.statistical),
    ]


def _series(name: str, kind: str, lines: Sequence[Priced]) -> Series:
    seconds = [line.more["seconds"] if kind == "statistical" else line.seconds_per_1000_rocks for line in lines]
    return Series(name, kind, seconds, [line.error for line in lines], [word_of(line.setting) for line in lines])


def _method_name(setting: Mapping[str, Any]) -> str:
    if setting["method"] == "stepping":
        squared = " (squared)" if setting["squared"] else ""
        return f"steps, threshold {setting['threshold']:g} m{squared}"
    return f"steps, raster of {setting['cell']:g} m" if setting["method"] == "raster" else "events"


def word_of(setting: Mapping[str, Any]) -> str:
    """A setting in a word or two."""
    if "rocks" in setting:
        return f"{setting['rocks']:,}"
    if "part" in setting:
        return "all" if setting["part"] == 1 else f"1/{setting['part']}"
    if setting["method"] == "events":
        return "events"
    return f"{setting['dt']:g} s"
