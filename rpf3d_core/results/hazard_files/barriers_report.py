"""Report what rocks did at barriers (caught, broken through, flown over): summary.json, barriers.csv, screen."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import PERCENTILES, share_of
from rpf3d_core.hazard.barriers import BarrierFigures
from rpf3d_core.hazard.benches import three_figures
from rpf3d_core.results.hazard_files.benches_csv import share_columns, write_csv

FIRST = ("first_caught", "first_broken_through", "first_flown_over")
ROCKS = (*FIRST, "caught")
EVENTS = ("caught_events", "broken_through_events", "flown_over_events")
P95 = 95
"""The percentile for which an interval is stated, because nets are designed for it."""
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

TEXT_HEADER = (
    "barrier", "came", "first caught", "first broken", "first over", "caught in the end", "p95 (kJ)", "p95 (m)",
)  # fmt: skip
"""Header of the table of barriers on the screen; `text_rows` returns its rows."""
TEXT_NOTE = (
    "rocks that came to each barrier, by what they did when they first came; p95 of their energies then, and of how "
    "high over the ground they crossed it"
)
MEANING = (
    "first_caught, first_broken_through and first_flown_over: each rock that came counts once, by its first arrival; "
    "caught: rocks that the barrier caught in the end, also of those that had passed it before; events: how often each "
    "happened, a rock may come several times; first_energy_j, first_height_over_ground_m and first_over_panel_m are of "
    "first arrivals; every rock finds a barrier whole, because rocks are independent of each other"
)


def barriers_section(barriers: Sequence[BarrierFigures]) -> dict[str, Any]:
    """Return the section of summary.json on barriers: for each name counts, shares, energies (J) and heights (m)."""
    return {figures.name: _facts(figures) for figures in barriers}


def write_barriers(path: Path, barriers: Sequence[BarrierFigures]) -> None:
    """Write barriers.csv, with a line for each barrier; unknown values are left empty.

    A value is unknown if no rock reached the barrier.
    """
    write_csv(path, HEADER, map(_line, barriers))


def text_rows(barriers: Sequence[BarrierFigures]) -> list[tuple[str, ...]]:
    """Return the rows of the table of barriers on the screen, in the scene's order."""
    return [_text_row(figures) for figures in barriers]


def _facts(figures: BarrierFigures) -> dict[str, Any]:
    counted = figures.counted
    return {
        "height_m": figures.height,
        "capacity_j": figures.capacity,
        "came": figures.came,
        **{did: share_of(getattr(figures, did), figures.came) for did in ROCKS},
        **{did: getattr(figures, did) for did in EVENTS},
        "first_energy_j": _distribution(counted.energy),
        "first_height_over_ground_m": _distribution(counted.height),
        "first_over_panel_m": _distribution(counted.over),
    }


def _distribution(sample: Sample) -> dict[str, Any]:
    """Return the percentiles of a quantity at a barrier, and the 95 % interval of p95.

    An end of the interval is None if there are too few rocks to determine it.
    """
    return {**sample.summary(PERCENTILES), "p95_interval_95": list(sample.interval(P95))}


def _line(figures: BarrierFigures) -> list[Any]:
    facts = _facts(figures)
    shares = [value for did in ROCKS for value in share_columns(facts[did])]
    designs = [facts["first_energy_j"], facts["first_height_over_ground_m"]]
    return [
        figures.name, figures.height, figures.capacity, figures.came, *shares, *(facts[did] for did in EVENTS),
        *(value for one in designs for value in (one["p95"], *one["p95_interval_95"], one["max"])),
        facts["first_over_panel_m"]["max"],
    ]  # fmt: skip


def _text_row(figures: BarrierFigures) -> tuple[str, ...]:
    facts = _facts(figures)
    energy, height = facts["first_energy_j"]["p95"], facts["first_height_over_ground_m"]["p95"]
    counts = (figures.came, *(getattr(figures, did) for did in ROCKS))
    return (
        figures.name, *(f"{count:,}" for count in counts),
        "-" if energy is None else three_figures(energy / 1000.0), "-" if height is None else three_figures(height),
    )  # fmt: skip
