"""The price list of a scene: error and cost of each setting, in the same units, so that settings can be compared."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from rpf3d_core.accuracy.differences import AnswerDifference, Metres
from rpf3d_core.accuracy.geometric import Coarser
from rpf3d_core.accuracy.in_contact import InContact
from rpf3d_core.accuracy.numerical import MeasuredSetting, OnRaster, Steps
from rpf3d_core.accuracy.parametric import OverSets
from rpf3d_core.accuracy.precise import DIGITS, ImpactErrors, impact_errors
from rpf3d_core.accuracy.statistical import Sampled, beyond_chance, floor_of

DEFINITIONS = {
    "error": (
        "distance between two maps of reach probability, from 0 (equal) to 1 (no cell in common): sum of |p - q| over "
        "all cells of the scene's raster, divided by the sum of p + q"
    ),
    "floor": "distance between two maps of the same number of different rocks, by events: the effect of chance alone",
    "of_shares": "largest difference of the share of rocks that reach, or stop in, an area of interest (or zone)",
    "numerical": "the same rocks, by events and in fixed steps; events: change of the map if all rocks start one "
    "contact tolerance farther east; rocks with a shape: the same rocks with other values of `accuracy`, "
    "compared with the finest: the root of distance^2 - floor^2, 0 where chance explains the distance; spheres and "
    "rocks with a shape have no rows of fixed steps and rasters, because these methods find only contacts of points",
    "distance": "numerical, rocks with a shape, and parametric: of the two maps, chance included",
    "geometric": "the same rocks over fewer triangles, compared with the full terrain; the error of the survey itself "
    "is not included",
    "statistical": "n rocks compared with all N flown rocks, divided by the square root of 1 - n/N: the expected "
    "distance from the map of infinitely many rocks",
    "parametric": "the maps of two parameter sets of the scene's unknowns: the root of the mean square distance over "
    "all pairs, without the effect of chance; empty if the scene has no unknowns, because the error is then unknown",
    "apart": "distance of the maps of two ensembles of that many rocks",
    "half_width": "of the widest 95 % Wilson interval of a share of an area of interest (or zone)",
    "p95_energy_half_width": "of the 95 % interval of the p95 of kinetic energy, between order statistics, over "
    "that p95",
    "seconds_per_1000_rocks": "of one processor core; numerical: every step is tested for contact, VTK, called from "
    "Python, finds the closest facet (compiled: this program's own index), and no maps are made; all others with maps; "
    "number of steps of all rocks times the time per step; timed is false if no step was timed at this setting and the "
    "time per step is that of a coarser setting",
    "seconds": "of one processor core for that many rocks",
    "rocks": "of the scene: rocks that a run flies (if auto, in the first round); of a line: rocks behind its error",
    "total": "sum of the numerical, the geometric and the statistical error: a bias and an interval do not cancel; the "
    "parametric error is not in it, because no setting reduces it",
}  # fmt: skip
UNITS = {
    "error": "1", "floor": "1", "apart": "1", "of_shares": "1", "half_width": "1", "p95_energy_half_width": "1",
    "distance": "1", "accuracy": "m",
    "dt": "s", "threshold": "m, or m2 where squared", "cell": "m", "first_impact_m": "m, [median, p95] over rocks",
    "stop_m": "m, [median, p95] over rocks at rest",
    "bounce_height_m": "m, [median, p95] over rocks, of the rise with the normal speed after the first impact",
    "seconds_per_1000_rocks": "s", "seconds": "s", "place_m": "m", "time_s": "s",
}  # fmt: skip
EVENTS: Mapping[str, Any] = {"method": "events"}
GROUPS = ("numerical", "geometric", "statistical", "parametric")
"""Names of the groups of a price list."""


class Priced(NamedTuple):
    """A line of the price list: one setting with its error and cost.

    setting : names and values that identify the setting, such as {"rocks": 1000}; error : (-)
    seconds_per_1000_rocks : computing time of 1,000 rocks, s of one core
    more : further values of the line, by name, for cost.json and the tables
    """

    setting: Mapping[str, Any]
    error: float
    seconds_per_1000_rocks: float
    more: Mapping[str, Any]


@dataclass(frozen=True)
class PriceList:
    """The price list of one scene: error and cost of each measured setting, in four groups of `Priced`.

    scene : name of the scene file; digest : of the scene; rocks : number of rocks of a run
    auto : True if the scene has `rocks: auto`; `rocks` is then the number of the first round
    method : the method setting of the scene; cell : side of a map cell, m; triangles : number of triangles
    numerical : lines for methods; geometric : lines for terrains; statistical : lines for numbers of rocks
    parametric : a single line, or none if the scene has no unknowns
    off_exact : rounding errors of exact contacts, found with 50 digits: an item for the first impacts of rocks, an item
        for the second impacts, and so on; empty if not measured
    """

    scene: str
    digest: str
    rocks: int
    auto: bool
    method: Mapping[str, Any]
    cell: float
    triangles: int
    numerical: Sequence[Priced]
    geometric: Sequence[Priced]
    statistical: Sequence[Priced]
    parametric: Sequence[Priced]
    off_exact: Sequence[ImpactErrors]


def priced_events(error: float, seconds_per_1000: float) -> Priced:
    """Return the line of the price list for exact contacts, with which `rpf3d cost` compares all other methods.

    error : (-), of the map, due to rounding; seconds_per_1000 : s of one core for 1,000 rocks
    """
    return Priced(setting=EVENTS, error=error, seconds_per_1000_rocks=seconds_per_1000, more={"timed": True})


def steps_setting(steps: Steps | OnRaster) -> dict[str, Any]:
    """Return a fixed-step setting as names and values (`Priced.setting`), which identify its line in the price list."""
    return {"method": "stepping" if isinstance(steps, Steps) else "raster", **steps._asdict()}


def priced_steps(found: MeasuredSetting, sampled: list[Sampled]) -> Priced:
    """Return the line of the price list for a fixed-step method: its setting, error and cost.

    sampled : statistical errors, which state how much of a difference is chance
    """
    price = found.vtk or found.compiled
    more = {
        **_off(found.off, found.rocks, sampled),
        "tunnelled": found.tunnelled,
        "steps_per_rock": found.steps,
        "timed": price.by_clock,
        "seconds_per_1000_rocks_compiled": found.compiled.seconds_per_1000,
    }
    return Priced(
        setting=steps_setting(found.setting),
        error=found.off.of_map,
        seconds_per_1000_rocks=price.seconds_per_1000,
        more=more,
    )


def contact_setting(accuracy: float) -> dict[str, Any]:
    """Return an accuracy of contact (m) of rocks with a shape as names and values (`Priced.setting`)."""
    return {"method": "contact", "accuracy": accuracy}


def priced_contact(found: InContact, sampled: list[Sampled]) -> Priced:
    """Return the line of the price list for one accuracy of the contact of rocks with a shape.

    The line has no error of the bounce height: the speed of a body after an impact also depends on its spin.

    found : measured error and cost of this accuracy; the error in the line is reduced by the part that may be chance
    sampled : statistical errors, which state how much of a difference is chance
    """
    more = {**_off(found.off, found.rocks, sampled), "bounce_height_m": [None, None], "distance": found.off.of_map}
    return Priced(
        setting=contact_setting(found.accuracy),
        error=beyond_chance(found.off.of_map, more["floor"]),
        seconds_per_1000_rocks=found.seconds_per_1000,
        more=more,
    )


def priced_terrain(found: Coarser, rocks: int, sampled: list[Sampled]) -> Priced:
    """Return the line of the price list for a coarser terrain: its error and cost.

    rocks : number of rocks flown; sampled : statistical errors, which state how much of a difference is chance
    """
    setting = {"part": found.part, "triangles": found.triangles}
    return Priced(
        setting=setting,
        error=found.off.of_map,
        seconds_per_1000_rocks=found.seconds_per_1000,
        more=_off(found.off, rocks, sampled),
    )


def priced_full_terrain(triangles: int, seconds_per_1000: float) -> Priced:
    """Return the line of the price list for the full terrain, whose geometric error counts as 0.

    triangles : number of triangles; seconds_per_1000 : s of one core for 1,000 rocks
    """
    return Priced(
        setting={"part": 1, "triangles": triangles}, error=0.0, seconds_per_1000_rocks=seconds_per_1000, more={}
    )


def priced_sample(found: Sampled) -> Priced:
    """Return the line of the price list for one number of rocks: its statistical error and cost."""
    more = {
        "apart": found.apart, "half_width": found.half_width, "p95_energy_half_width": found.energy,
        "seconds": found.seconds,
    }  # fmt: skip
    return Priced(
        setting={"rocks": found.rocks},
        error=found.of_map,
        seconds_per_1000_rocks=1000.0 * found.seconds / found.rocks,
        more=more,
    )


def priced_unknowns(found: OverSets) -> Priced:
    """Return the line of the price list for the unknowns of a scene: their parametric error."""
    more = {"distance": found.distance, "of_shares": found.of_shares, "rocks": found.rocks}
    setting = {"sets": found.sets}
    return Priced(setting=setting, error=found.of_map, seconds_per_1000_rocks=found.seconds_per_1000, more=more)


def _off(off: AnswerDifference, rocks: int, sampled: list[Sampled]) -> dict[str, Any]:
    return {
        "floor": floor_of(rocks, sampled),
        "of_shares": off.of_shares,
        "first_impact_m": _both(off.first_impact),
        "stop_m": _both(off.stop),
        "bounce_height_m": _both(off.bounce),
        "other_outcome": off.other_outcome,
        "rocks": rocks,
    }


def _both(metres: Metres) -> list[float | None]:
    return [metres.median, metres.p95]


def section(prices: PriceList) -> dict[str, Any]:
    """Return the price list as plain values for cost.json."""
    exact = [
        {"impact": number, "rocks": off.impacts, "place_m": [off.place_median, off.place_max],
         "time_s": [off.time_median, off.time_max]}
        for number, off in enumerate(prices.off_exact, start=1)
    ]  # fmt: skip
    return {
        "program": "rpf3d",
        "scene": {
            "file": prices.scene,
            "digest": prices.digest,
            "rocks": prices.rocks,
            "auto": prices.auto,
            "method": dict(prices.method),
        },
        "terrain": {"triangles": prices.triangles},
        "cell_m": prices.cell,
        "definitions": DEFINITIONS,
        "units": UNITS,
        **{name: [_line(line) for line in getattr(prices, name)] for name in GROUPS},
        "events_against_exact_arithmetic": {"digits": DIGITS, "median_and_largest_by_impact": exact},
    }


def _line(line: Priced) -> dict[str, Any]:
    return {
        "setting": dict(line.setting), "error": line.error, "seconds_per_1000_rocks": line.seconds_per_1000_rocks,
        **line.more,
    }  # fmt: skip


def _priced(line: Mapping[str, Any]) -> Priced:
    more = {key: value for key, value in line.items() if key not in KEPT}
    return Priced(
        setting=line["setting"], error=line["error"], seconds_per_1000_rocks=line["seconds_per_1000_rocks"], more=more
    )


KEPT = ("setting", "error", "seconds_per_1000_rocks")


def price_list_of(facts: Mapping[str, Any]) -> PriceList:
    """Return the price list in the content of a cost.json; facts : the content, as plain values.

    Raise a KeyError, TypeError or ValueError if the values are not a price list.
    """
    scene = facts["scene"]
    lines = {
        name: [_priced(line) for line in facts[name]]
        for name in GROUPS
    }  # fmt: skip
    exact = facts["events_against_exact_arithmetic"]["median_and_largest_by_impact"]
    off = [impact_errors(one["rocks"], one["place_m"], one["time_s"]) for one in exact]
    return PriceList(
        scene["file"], scene["digest"], scene["rocks"], scene["auto"], scene["method"], facts["cell_m"],
        facts["terrain"]["triangles"], **lines, off_exact=off,
    )  # fmt: skip
