"""Make the printed table of barriers: several rows for each barrier, one for each figure, with intervals."""

from collections.abc import Iterator, Sequence
from typing import Any

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.ensemble.statistics import sampling_of
from rpf3d_core.hazard.benches import (
    ALL_SOURCES,
    NOT_KNOWN,
    SHORT,
    SOURCE,
    in_percent,
    interval_in_percent,
    interval_text,
)
from rpf3d_core.hazard.by_source.worst_barriers import has_source_barriers
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.results.hazard_files.barriers_report import ROCKS, barriers_section, shown_section

HEADER = ("barrier", "of first arrivals", "rocks", "value")
PREDICTIVE, SAMPLING = "95 % predictive", "95 % sampling"
"""Headers of the columns of intervals; the table has the column PREDICTIVE only in a run over parameter sets."""
SHARES = ("first caught", "first broken", "first over", "caught in the end")
"""Labels of the shares in the table, in the order of `barriers_report.ROCKS`."""
NOTE = (
    "came: share of all rocks that reached the barrier; caught, broken, over: shares of these rocks; energies and "
    "heights are those of their first arrivals"
)
"""Note under the table that explains its rows."""
SAMPLING_NOTE = "sampling: includes only the uncertainty due to the number of rocks, not that of the ground"
"""Note under the table that states what its sampling intervals do not include."""

NOTE_ON_SOURCES = (
    f"source: {ALL_SOURCES} for the rocks of all sources together, or the source whose share is clearly worse, or "
    "whose p95 is the largest; shares are of the rocks of this source; every source is in hazard/source_barriers.csv"
)
"""Note under the table of a scene with several sources."""

KILO = 1000.0
"""Joules in a kilojoule."""

Ends = Sequence[float | None] | None


def text_header(maps: HazardMaps) -> tuple[str, ...]:
    """Return the header of the printed table of barriers.

    For a scene with several sources, the table has a column of sources. For a run over parameter sets, the table has a
    column of predictive intervals.
    """
    begin = (*HEADER[:2], SOURCE, *HEADER[2:]) if has_source_barriers(maps) else HEADER
    return (*begin, SAMPLING) if maps.sets is None else (*begin, PREDICTIVE, SAMPLING)


def notes_below(maps: HazardMaps) -> list[str]:
    """Return the notes under the printed table of barriers."""
    return [NOTE, *([NOTE_ON_SOURCES] if has_source_barriers(maps) else []), SAMPLING_NOTE]


def text_rows(maps: HazardMaps) -> list[tuple[str, ...]]:
    """Return the rows of the printed table, with the columns of `text_header`, in the scene's order of barriers."""
    rows, together = [], barriers_section(maps)
    for name, facts in shown_section(maps).items():
        largest = together[name]["first_energy_j"]["max"]
        for number, (label, source, rocks, value, predictive, sampling) in enumerate(_rows(facts, largest)):
            sources = (source,) if has_source_barriers(maps) else ()
            intervals = (sampling,) if maps.sets is None else (predictive, sampling)
            rows.append(("" if number else name, label, *sources, rocks, value, *intervals))
    return rows


def _rows(facts: dict[str, Any], largest: float | None) -> Iterator[tuple[str, str, str, str, str, str]]:
    """Yield the row of each figure of a barrier: label, source, rocks, value, predictive and sampling interval.

    facts : counts, shares and percentiles of the barrier, from `shown_section`
    largest : largest energy of all rocks (J), None if no rock arrived
    """
    for label, name in zip(("came", *SHARES), ("reached", *ROCKS), strict=True):
        share = facts[name]
        value = "-" if share["share"] is None else f"{in_percent(share['share'], SHORT)} %"
        intervals = _percent(share.get("predictive")), _percent(sampling_of(share))
        yield label, _source(share), f"{share['rocks']:,}", value, *intervals
    yield _design("p95 energy (kJ)", facts["first_energy_j"], KILO)
    # The largest energy may grow with the number of rocks, so it has no interval.
    yield "largest energy (kJ)", ALL_SOURCES, "", _number(largest, KILO), NOT_KNOWN, NOT_KNOWN
    yield "capacity (kJ)", "", "", _number(facts["capacity_j"], KILO), "", ""
    yield _design("p95 height (m)", facts["first_height_over_ground_m"], 1.0)


def _source(figure: dict[str, Any]) -> str:
    """Return the source of a figure as text."""
    return figure.get("source") or ALL_SOURCES


def _design(label: str, found: dict[str, Any], unit: float) -> tuple[str, str, str, str, str, str]:
    """Return the row of the 95th percentile of a quantity, with the columns of `_rows`.

    label : first cell; found : the quantity, from `barriers_section`, in SI units
    unit : number of SI units in one displayed unit, such as KILO for kJ
    """
    intervals = (interval_text(found.get("p95_predictive"), unit), interval_text(found["p95_interval_95"], unit))
    return label, _source(found), f"{found['rocks']:,}", _number(found["p95"], unit), *intervals


def _percent(ends: Ends) -> str:
    """Return the interval of a share in per cent as text; NOT_KNOWN if `ends` (-) is None, or an end is None."""
    if ends is None or ends[0] is None or ends[1] is None:
        return NOT_KNOWN
    return f"{interval_in_percent(ends[0], ends[1])} %"


def _number(value: float | None, unit: float) -> str:
    return "-" if value is None else three_figures(value / unit)
