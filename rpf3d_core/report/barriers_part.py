"""Make the part of a report on the barriers of the scene: shares, energies and heights, with their 95 % intervals."""

from collections.abc import Iterator
from typing import Any

from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.report.elements import Element, Heading, Table, Text
from rpf3d_core.report.words import Words, given, height, interval, kilojoules, share_cells

BOTH = ("95 % predictive", "95 % sampling")
SHARES = {
    "reached": "came",
    "caught": "caught in the end",
    "first_broken_through": "first broken through",
    "first_flown_over": "first flown over",
}
"""Label of each share of the rocks that reached a barrier, by its name in summary.json."""
NOTE = (
    "Shares are of the rocks that reached the barrier, except `came`, a share of all rocks: rocks that pass beside its "
    "ends do not reach it. Each rock meets an undamaged barrier. With `measured_at: centre`, the default, a rock is "
    "caught if its centre is not above the panel, although its top may be; `measured_at: top` is stricter. Energies "
    "and heights are those of first arrivals. The largest energy is that of the simulated rocks: other rocks may have "
    "a larger one."
)
SAMPLING_ONLY = (
    "A sampling interval includes only the uncertainty due to the number of rocks, not that of the ground. Do not use "
    "it for design if the predictive interval is unknown."
)
OF_WORST = (
    "A figure with a source counts the rocks from this source only. The number of rocks that came and the largest "
    "energy are those of all rocks."
)
"""Note under the tables of a scene with several sources."""
LEAVES_OUT = "Predictive intervals at barriers leave out the misfit of the model."


def barriers_part(barriers: dict[str, Any], rocks: int) -> Iterator[Element]:
    """Yield the heading, tables and notes on what rocks did at the barriers of the scene.

    barriers : the section `barriers` of summary.json; rocks : number of rocks flown
    """
    shown = {name: worst_of(found, rocks) for name, found in barriers.items()}
    yield Heading("Barriers of the scene", 3)
    yield Table(("barrier", "rocks", "", "share", *BOTH), [
        ["" if number else name, "" if number else f"{found['came']:,}", f"{label}{from_of(found[did])}",
         *share_cells(found[did])]
        for name, found in shown.items() for number, (did, label) in enumerate(SHARES.items())
    ])  # fmt: skip
    yield Table(("barrier", "p95 energy", *BOTH, "largest energy", "capacity"), [
        [f"{name}{from_of(found['first_energy_j'])}", *_design(found["first_energy_j"], kilojoules),
         kilojoules(barriers[name]["first_energy_j"]["max"]), kilojoules(found["capacity_j"])]
        for name, found in shown.items()
    ])  # fmt: skip
    yield Table(("barrier", "p95 height", *BOTH, "height of the panel"), [
        [f"{name}{from_of(found['first_height_over_ground_m'])}",
         *_design(found["first_height_over_ground_m"], height), f"{given(found['height_m'])} m"]
        for name, found in shown.items()
    ])  # fmt: skip
    of_worst = f" {OF_WORST}" if any("worst_source" in found for found in barriers.values()) else ""
    yield Text(f"{NOTE}{of_worst} {SAMPLING_ONLY}", quiet=True)
    if any("leaves_out" in found for found in barriers.values()):
        yield Text(LEAVES_OUT, quiet=True)


def worst_of(found: dict[str, Any], rocks: int) -> dict[str, Any]:
    """Return the section of a barrier with its worst figures, each of the source that is worst for this figure.

    `reached`, the share of all rocks flown that came to the barrier, is added if the section does not have it.

    found : section of the barrier in summary.json; rocks : number of rocks flown
    """
    return {"reached": share_of(found["came"], rocks), **found, **found.get("worst_source", {})}


def from_of(figure: dict[str, Any]) -> str:
    """Return the source of a figure of `worst_of` as text, such as `, from crest`; "" for a figure of all rocks."""
    return f", from {figure['source']}" if figure.get("source") else ""


def _design(found: dict[str, Any], words: Words) -> list[str]:
    """Return the 95th percentile of a quantity at a barrier as three cells: value, predictive and sampling interval.

    found : section of the quantity in summary.json; words : function that turns a number into text with its unit
    """
    return [
        words(found["p95"]),
        interval(found.get("p95_predictive"), words),
        interval(found["p95_interval_95"], words),
    ]
