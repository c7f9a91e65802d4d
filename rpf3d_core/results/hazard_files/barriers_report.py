"""Report the rocks at barriers (caught, broken through, flown over): summary.json and barriers.csv."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import PERCENTILES, share_of
from rpf3d_core.hazard.barriers import BarrierFigures
from rpf3d_core.hazard.benches import with_predictive
from rpf3d_core.hazard.by_source.each_source import maps_of_source
from rpf3d_core.hazard.by_source.worst import ALL
from rpf3d_core.hazard.by_source.worst_barriers import has_source_barriers, worst_at_barriers
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.results.hazard_files.benches_csv import OF_SOURCE, share_columns, write_csv

FIRST = ("first_caught", "first_broken_through", "first_flown_over")
ROCKS = (*FIRST, "caught")
EVENTS = ("caught_events", "broken_through_events", "flown_over_events")
P95 = 95
"""The percentile that is stated with an interval, because nets are designed for this percentile."""
HEADER = [
    "name", "height_m", "capacity_j", "came_rocks",
    *(f"{did}_{part}" for did in ROCKS for part in ("rocks", "share", "low", "high")),
    *EVENTS,
    *(f"first_{what}_{part}" for what in ("energy_j", "height_over_ground_m")
      for part in ("p95", "p95_low", "p95_high", "max")),
    "first_over_panel_m_max",
]  # fmt: skip
"""Columns of barriers.csv.

Shares are of the rocks that reached the barrier; `low` and `high` are the ends of 95 % intervals: Wilson's for shares,
and the interval of p95.
"""

OF_SETS = [
    *(f"{what}_predictive_{end}" for what in ("came", *ROCKS, "first_energy_j_p95", "first_height_over_ground_m_p95")
      for end in ("low", "high")),
]  # fmt: skip
"""Further columns of a run over parameter sets: predictive intervals; a cell is empty if its value is unknown.

`came` : the share of all rocks flown that reached the barrier
"""
MEANING = (
    "first_caught, first_broken_through and first_flown_over: each rock that reached the barrier counts once, by its "
    "first arrival; caught: rocks that the barrier caught in the end, also of those that had passed it before; events: "
    "how often each happened, a rock may arrive several times; first_energy_j, first_height_over_ground_m and "
    "first_over_panel_m are of first arrivals; each rock meets an undamaged barrier, because rocks are independent of "
    "each other"
)


def barriers_section(maps: HazardMaps) -> dict[str, Any]:
    """Return the section of summary.json on barriers, by barrier name: counts, shares, energies (J) and heights (m).

    In a run over parameter sets, shares and p95 values have a sampling and a predictive interval. `reached`, the share
    of all rocks flown that reached the barrier, is then included as well.
    """
    return {figures.name: _facts(figures, maps.flown, band) for figures, band in zip(*_banded(maps), strict=True)}


def worst_section(maps: HazardMaps) -> dict[str, dict[str, Any]]:
    """Return, by barrier name, each figure of the barrier, taken from the source for which this figure is worst.

    Each figure has the form of `barriers_section` and the key `source`: the name of the source, None if the figure is
    of all rocks together. The result is {} if barriers are not counted for each source.
    """
    if not has_source_barriers(maps):
        return {}
    worst = worst_at_barriers(maps)
    wanted = {number for numbers in worst.values() for number in numbers} - {ALL}
    each = {ALL: _with_reached(maps), **{number: _with_reached(maps_of_source(maps, number)) for number in wanted}}
    names = {ALL: None, **dict(enumerate(maps.sources.names))}
    return {
        at.name: {
            figure: {"source": names[numbers[b]], **each[numbers[b]][at.name][figure]}
            for figure, numbers in worst.items()
        }
        for b, at in enumerate(maps.barriers)
    }


def shown_section(maps: HazardMaps) -> dict[str, Any]:
    """Return the section of barriers for printed tables.

    It contains `reached`, and each figure is taken from the source for which this figure is worst (`worst_section`).
    """
    worst = worst_section(maps)
    return {name: {**facts, **worst.get(name, {})} for name, facts in _with_reached(maps).items()}


def _with_reached(maps: HazardMaps) -> dict[str, Any]:
    """Return the section of barriers, in which each barrier has `reached`, the share of all rocks flown."""
    return {
        name: {"reached": share_of(facts["came"], maps.flown), **facts}
        for name, facts in barriers_section(maps).items()
    }


def write_barriers(path: Path, maps: HazardMaps) -> None:
    """Write barriers.csv, with a line for each barrier; unknown values are left empty.

    Shares, energies and heights are unknown if no rock reached the barrier. An end of an interval is also unknown if
    too few rocks reached the barrier.
    """
    write_csv(path, _header(maps), _lines(maps))


def write_source_barriers(path: Path, maps: HazardMaps) -> None:
    """Write source_barriers.csv: the lines of barriers.csv for each source, with the columns OF_SOURCE before them.

    Sources of which no rock has flown are left out.

    maps : of a scene in which barriers are counted for each source
    """
    sources = zip(maps.sources.names, maps.sources.flown.tolist(), strict=True)
    lines = (
        [name, rocks, *line] for number, (name, rocks) in enumerate(sources) if rocks
        for line in _lines(maps_of_source(maps, number))
    )  # fmt: skip
    write_csv(path, [*OF_SOURCE, *_header(maps)], lines)


def _header(maps: HazardMaps) -> list[str]:
    return HEADER if maps.sets is None else [*HEADER, *OF_SETS]


def _lines(maps: HazardMaps) -> Iterator[list[Any]]:
    """Yield the line of each barrier in barriers.csv."""
    return (_line(figures, band) for figures, band in zip(*_banded(maps), strict=True))


def _banded(maps: HazardMaps) -> tuple[tuple[BarrierFigures, ...], tuple[Any, ...]]:
    """Return two sequences with an item for each barrier: its figures, and its predictive intervals.

    Without parameter sets, each item of the second sequence is None.
    """
    return maps.barriers, (None,) * len(maps.barriers) if maps.sets is None else maps.sets.barriers


def _facts(figures: BarrierFigures, flown: int, band: Mapping[str, tuple[float, float]] | None) -> dict[str, Any]:
    counted = figures.counted
    shares = {did: share_of(getattr(figures, did), figures.came) for did in ROCKS}
    designs = {"first_energy_j": _distribution(counted.energy),
               "first_height_over_ground_m": _distribution(counted.height)}  # fmt: skip
    if band is not None:
        shares = {did: with_predictive(share, *band[did]) for did, share in shares.items()}
        shares["reached"] = with_predictive(share_of(figures.came, flown), *band["came"])
        for design, name in zip(designs.values(), ("energy", "height"), strict=True):
            design["p95_predictive"] = _known(band[name])
    return {
        "height_m": figures.height,
        "capacity_j": figures.capacity,
        "came": figures.came,
        **shares,
        **{did: getattr(figures, did) for did in EVENTS},
        **designs,
        "first_over_panel_m": _distribution(counted.over),
    }


def _known(ends: tuple[float, float]) -> list[float | None]:
    """Return the ends of an interval, with None in place of NaN for an unknown end."""
    return [None if math.isnan(end) else end for end in ends]


def _distribution(sample: Sample) -> dict[str, Any]:
    """Return the percentiles of a quantity at a barrier, and the 95 % interval of p95.

    An end of the interval is None if there are too few rocks to determine it.
    """
    return {**sample.summary(PERCENTILES), "p95_interval_95": list(sample.interval(P95))}


def _line(figures: BarrierFigures, band: Mapping[str, tuple[float, float]] | None) -> list[Any]:
    facts = _facts(figures, 0, None)  # no parameter sets are passed, so that low and high are sampling intervals
    shares = [value for did in ROCKS for value in share_columns(facts[did])]
    designs = [facts["first_energy_j"], facts["first_height_over_ground_m"]]
    predictive = [] if band is None else [
        end for name in ("came", *ROCKS, "energy", "height") for end in _known(band[name])
    ]  # fmt: skip
    return [
        figures.name, figures.height, figures.capacity, figures.came, *shares, *(facts[did] for did in EVENTS),
        *(value for one in designs for value in (one["p95"], *one["p95_interval_95"], one["max"])),
        facts["first_over_panel_m"]["max"], *predictive,
    ]  # fmt: skip
