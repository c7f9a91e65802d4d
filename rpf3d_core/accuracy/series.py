"""The price list as series of points for plots of error against computing time."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

from rpf3d_core.accuracy.price_list import Priced, PriceList
from rpf3d_core.results.series import LEAST, Colour, Series

BLACK, GREEN, BLUE = (0, 0, 0), (44, 160, 44), (31, 119, 180)
STEPS = (
    (253, 174, 97), (244, 109, 67), (165, 0, 38), (123, 50, 148), (166, 166, 166), (102, 102, 102), (140, 86, 75),
    (227, 119, 194),
)  # fmt: skip
"""Colours of the fixed-step methods, in their order; there are at least as many colours as measured methods."""


def series_of(prices: PriceList) -> list[Series]:
    """Return the series of points of a price list, one for each curve in the plot of error against computing time.

    A series without points is left out, such as fewer triangles on a terrain too small for a coarser mesh.

    The time of a point (s of one core) is the time for 1,000 rocks; in the statistical series, the time for the number
    of rocks of the point.
    """
    groups: dict[str, list[Priced]] = {}
    for line in prices.numerical:
        groups.setdefault(_method_name(line.setting), []).append(line)
    steps = cycle(STEPS)
    fewer = [line for line in prices.geometric if line.setting["part"] > 1]
    found = [
        *(_numerical(name, lines, BLACK if name == "events" else next(steps)) for name, lines in groups.items()),
        _series("fewer triangles", "geometric", GREEN, fewer, [line.seconds_per_1000_rocks for line in fewer]),
        _series(
            "number of rocks", "statistical", BLUE, prices.statistical,
            [line.more["seconds"] for line in prices.statistical],
        ),
    ]  # fmt: skip
    return [one for one in found if one.errors]


def _numerical(name: str, lines: Sequence[Priced], colour: Colour) -> Series:
    found = _series(name, "numerical", colour, lines, [line.seconds_per_1000_rocks for line in lines])
    if lines[0].setting["method"] != "stepping":
        return found
    return found._replace(compiled=[line.more["seconds_per_1000_rocks_compiled"] for line in lines])


def _series(name: str, kind: str, colour: Colour, lines: Sequence[Priced], seconds: Sequence[float]) -> Series:
    errors = [max(line.error, LEAST) for line in lines]
    return Series(
        name=name, kind=kind, colour=colour, seconds=seconds, errors=errors, words=[_beside(line) for line in lines]
    )


def _beside(line: Priced) -> str:
    """Return the label of a point in the plot; the label states the error if the error is too small to be drawn."""
    word = word_of(line.setting)
    return word if line.error >= LEAST else f"{word}: {line.error:.1g}"


def _method_name(setting: Mapping[str, Any]) -> str:
    if setting["method"] == "contact":
        return "accuracy of contact"
    if setting["method"] == "stepping":
        unit = "m2, squared" if setting["squared"] else "m"
        return f"steps, threshold {setting['threshold']:g} {unit}"
    return f"steps, raster of {setting['cell']:g} m" if setting["method"] == "raster" else "events"


def word_of(setting: Mapping[str, Any]) -> str:
    """Return a short label of a setting for plots and tables, for example "1/4" or "0.001 s"."""
    if "rocks" in setting:
        return f"{setting['rocks']:,}"
    if "part" in setting:
        return "all" if setting["part"] == 1 else f"1/{setting['part']}"
    if "sets" in setting:
        return f"{setting['sets']} sets"
    if setting["method"] == "events":
        return "events"
    if setting["method"] == "contact":
        return f"{1000.0 * setting['accuracy']:g} mm"
    return f"{setting['dt']:g} s"
