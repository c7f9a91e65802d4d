"""Show the price list as tables for the screen and for Markdown, and its findings as sentences."""

from collections.abc import Sequence
from typing import Any

from rpf3d_core.accuracy.choice import Choice, cheapest, cheapest_by_events, errors_of_scene, largest
from rpf3d_core.accuracy.precise import DIGITS
from rpf3d_core.accuracy.price_list import EVENTS, Priced, PriceList
from rpf3d_core.accuracy.series import word_of

Row = tuple[str, ...]

NUMERICAL_HEADER = (
    "numerical: method", "dt, s", "map error", "chance", "shares", "impact, m", "stop, m", "bounce, m",
    "tunnelled", "s / 1,000 rocks", "compiled",
)  # fmt: skip
GEOMETRIC_HEADER = (
    "geometric: triangles", "part", "map error", "chance", "shares", "impact, m", "stop, m", "bounce, m",
    "s / 1,000 rocks",
)  # fmt: skip
STATISTICAL_HEADER = (
    "statistical: rocks", "map error", "shares, half-width", "p95 energy, half-width", "s", "s / 1,000 rocks",
)  # fmt: skip
PARAMETRIC_HEADER = ("parametric: sets of the unknowns", "map error", "shares, range", "s / 1,000 rocks")
SPEND = {
    "numerical": "use exact contacts, or a finer step or accuracy",
    "geometric": "a finer survey reduces the total most",
    "statistical": "more rocks reduce the total most",
    "parametric": "a calibration (`rpf3d calibrate`) or narrower ranges reduce this error most; neither rocks nor a "
    "finer survey replace it",
}
"""Advice on how to reduce the largest error, by the name of the error."""
NOTE = (
    "map error: share of all visits to cells that one map has elsewhere than the other (0 to 1); chance: the same "
    "between maps of as many, but other, rocks; lengths are medians; seconds are those of one core; with ~, no step "
    "was timed at this setting: the time per step is that of a coarser setting"
)


def numerical_rows(prices: PriceList) -> list[Row]:
    """Return a row for each method of finding contacts, for the table of numerical errors."""
    return [_numerical(line) for line in prices.numerical]


def _numerical(line: Priced) -> Row:
    setting, more = line.setting, line.more
    dt = f"{setting['dt']:g}" if "dt" in setting else ""
    timed = "" if more.get("timed", True) else "~"
    compiled = more.get("seconds_per_1000_rocks_compiled")
    return (
        _method(setting), dt, number(line.error), number(more.get("floor")), number(more.get("of_shares")),
        *_lengths(more), number(more.get("tunnelled")), timed + number(line.seconds_per_1000_rocks), number(compiled),
    )  # fmt: skip


def _method(setting: Any) -> str:
    if setting["method"] == "stepping":
        return f"threshold {setting['threshold']:g} {'m2, squared' if setting['squared'] else 'm'}"
    if setting["method"] == "contact":
        return f"contact at {1000.0 * setting['accuracy']:g} mm"
    return f"raster, cell {setting['cell']:g} m" if setting["method"] == "raster" else "events (exact)"


def geometric_rows(prices: PriceList) -> list[Row]:
    """Return a row for each terrain, for the table of geometric errors."""
    return [
        (
            f"{line.setting['triangles']:,}", word_of(line.setting), number(line.error), number(line.more.get("floor")),
            number(line.more.get("of_shares")), *_lengths(line.more), number(line.seconds_per_1000_rocks),
        )
        for line in prices.geometric
    ]  # fmt: skip


def statistical_rows(prices: PriceList) -> list[Row]:
    """Return a row for each number of rocks, for the table of statistical errors."""
    return [
        (
            word_of(line.setting), number(line.error), number(line.more["half_width"]),
            number(line.more["p95_energy_half_width"]), number(line.more["seconds"]),
            number(line.seconds_per_1000_rocks),
        )
        for line in prices.statistical
    ]  # fmt: skip


def parametric_rows(prices: PriceList) -> list[Row]:
    """Return a list with the one row of the table of the parametric error; [] for a scene without unknowns."""
    return [
        (
            str(line.setting["sets"]), number(line.error), number(line.more["of_shares"]),
            number(line.seconds_per_1000_rocks),
        )
        for line in prices.parametric
    ]  # fmt: skip


def _lengths(more: Any) -> Row:
    return tuple(number((more.get(name) or [None])[0]) for name in ("first_impact_m", "stop_m", "bounce_height_m"))


def number(value: float | None) -> str:
    """Return a number, rounded to two significant digits, as text for a table cell; "" for None."""
    if value is None:
        return ""
    if value == 0.0:
        return "0"
    text = f"{value:.2g}"
    return f"{float(text):,.0f}" if 100.0 <= abs(value) < 1e7 else text


def findings(prices: PriceList, target: float) -> list[str]:
    """Return the conclusions from a price list as sentences, such as on the largest error and the cheapest setting.

    target : largest total error (-)
    """
    errors = errors_of_scene(prices)
    labels = {
        "numerical": "numerical (the scene's method)",
        "geometric": "geometric (half of its triangles)",
        "statistical": f"statistical ({_rocks(prices.rocks)}{', the first of `rocks: auto`' if prices.auto else ''})",
        "parametric": "parametric (values of the ground)",
    }
    beyond = _beyond_rocks(prices, target)
    without = ", without the unknown ground" if beyond else ""
    each = ", ".join(f"{labels[name]} {number(error)}" for name, error in errors.items())
    return [
        *_exactness(prices),
        *_left_out(prices),
        f"errors of this scene: {each}; {_largest(prices)}",
        *beyond,
        f"total up to {target:g} (sum of the three errors, relative to the full terrain{without}), cheapest: "
        f"{_choice(cheapest(prices, target))}",
        f"`rpf3d run --accuracy {target:g}` flies {_choice(cheapest_by_events(prices, target))}",
        *_unknown_error(prices),
    ]


def _unknown_error(prices: PriceList) -> list[str]:
    """Return a list with a sentence if the parametric error is unknown, for a scene without unknowns; else []."""
    if prices.parametric:
        return []
    return ["parametric error: unknown, because the scene gives every value of the ground as known. Give ranges "
            "with `library` or `prior`: this error is often the largest"]  # fmt: skip


def _beyond_rocks(prices: PriceList, target: float) -> list[str]:
    """Return a list with a sentence if the parametric error alone is above the target; else [].

    No number of rocks meets the target then.

    target : largest total error (-)
    """
    error = errors_of_scene(prices).get("parametric")
    if error is None or error <= target:
        return []
    return [f"no number of rocks reaches {target:g}: with the ranges that the scene gives for the ground, the map may "
            f"be wrong by {number(error)} with any number of rocks"]  # fmt: skip


def _rocks(number: int) -> str:
    return f"{number:,} {'rock' if number == 1 else 'rocks'}"


def _largest(prices: PriceList) -> str:
    name = largest(prices)
    return "none of them is seen" if name is None else f"the largest is the {name} one: {SPEND[name]}"


def _left_out(prices: PriceList) -> list[str]:
    """Return a list with a sentence on methods that were not measured, for spheres and bodies; [] for points."""
    if prices.method["method"] == "contact":
        return [
            "rocks with a shape: the numerical error is that of `accuracy` against the finest, beyond chance; fixed "
            "steps, rasters and impacts with 50 digits are for points, and are left out"
        ]
    if all(line.setting == EVENTS for line in prices.numerical):
        return [
            "spheres: fixed steps, rasters and impacts with 50 digits are left out, because these methods find only "
            "contacts of points"
        ]
    return []


def _exactness(prices: PriceList) -> list[str]:
    if not prices.off_exact:
        return []
    first, last = prices.off_exact[0], prices.off_exact[-1]
    largest_off = max(off.place_max for off in prices.off_exact)
    return [
        f"events against {DIGITS} digits: rounding moves the first impact by {first.place_median:.1e} m (median of "
        f"{_rocks(first.impacts)}) and by at most {first.place_max:.1e} m; of all impacts up to the "
        f"{ordinal(len(prices.off_exact))}, which only {_rocks(last.impacts)} had, rounding moves none by more than "
        f"{largest_off:.1e} m"
    ]


def _choice(choice: Choice | None) -> str:
    if choice is None:
        return "nothing that was measured keeps to it"
    parts = [
        f"{_rocks(choice.rocks)} by {_method(choice.method)}"
        + (f", dt {choice.method['dt']:g} s" if "dt" in choice.method else ""),
        f"{choice.terrain['triangles']:,} triangles"
        + (f" (the mesh, decimated to {word_of(choice.terrain)})" if choice.terrain["part"] > 1 else ""),
        f"total {number(choice.total)}, {number(choice.seconds)} s of one core",
    ]
    return ", ".join(parts)


def ordinal(number: int) -> str:
    """Return an ordinal number as text: 1st, 2nd, 3rd, 4th, ..., 11th, ..., 21st."""
    word = "th" if number // 10 % 10 == 1 else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{word}"


def tables(prices: PriceList) -> list[tuple[Row, list[Row]]]:
    """Return the tables of a price list, each as header and rows; a scene without unknowns has no table of unknowns."""
    unknowns = [(PARAMETRIC_HEADER, parametric_rows(prices))] if prices.parametric else []
    return [
        (NUMERICAL_HEADER, numerical_rows(prices)),
        (GEOMETRIC_HEADER, geometric_rows(prices)),
        (STATISTICAL_HEADER, statistical_rows(prices)),
        *unknowns,
    ]


def document(prices: PriceList, target: float) -> str:
    """Return the price list as a page of Markdown without a title: findings, tables and a note.

    target : largest total error (-), for the findings
    """
    lines = [f"- {line}" for line in findings(prices, target)]
    return "\n\n".join(["\n".join(lines), *(markdown(*table) for table in tables(prices)), NOTE])


def markdown(header: Sequence[str], rows: Sequence[Row]) -> str:
    """Return a header and rows as a table in Markdown."""
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
