"""What rocks did at barriers, for the summary, for hazard/barriers.csv, and for the screen."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rpf3d_core.ensemble.statistics import PERCENTILES, share_of
from rpf3d_core.hazard.barriers import BarrierFigures
from rpf3d_core.hazard.benches import three_figures

DID = ("caught", "broken_through", "flown_over")
HEADER = [
    "name", "height_m", "capacity_j", "came_rocks",
    *(f"{did}_{part}" for did in DID for part in ("rocks", "share", "low", "high")),
    "energy_j_p95", "energy_j_max", "height_over_ground_m_p95", "height_over_ground_m_max", "over_panel_m_max",
]  # fmt: skip
"""Shares are of the rocks that came; `low` and `high` are the ends of their 95 % Wilson intervals."""

TEXT_HEADER = ("barrier", "came", "caught", "broken", "over", "p95 (kJ)", "p95 (m)")
"""Of the printed table; `text_rows` has its columns."""
TEXT_NOTE = "rocks that came to each barrier; p95 of their energies, and of how high over the ground they crossed it"
MEANING = (
    "each rock counts once: caught, else broken through, else flown over; shares are of those that came; every rock "
    "finds a barrier whole, for rocks are independent of each other"
)


def barriers_section(barriers: Sequence[BarrierFigures]) -> dict[str, Any]:
    """For summary.json: name -> counts, shares with intervals, energies (J) and heights (m)."""
    return {figures.name: _facts(figures) for figures in barriers}


def write_barriers(path: Path, barriers: Sequence[BarrierFigures]) -> None:
    """Write a line for each barrier; what no rock leaves unknown is left empty."""
    with path.open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(HEADER)
        lines.writerows(_line(figures) for figures in barriers)


def text_rows(barriers: Sequence[BarrierFigures]) -> list[tuple[str, ...]]:
    """Rows under `TEXT_HEADER`, in the scene's order."""
    return [_text_row(figures) for figures in barriers]


def _facts(figures: BarrierFigures) -> dict[str, Any]:
    return {
        "height_m": figures.height,
        "capacity_j": figures.capacity,
        "came": figures.came,
        **{did: share_of(getattr(figures, did), figures.came) for did in DID},
        "energy_j": figures.counted.energy.summary(PERCENTILES),
        "height_over_ground_m": figures.counted.height.summary(PERCENTILES),
        "over_panel_m": figures.counted.over.summary(PERCENTILES),
    }


def _line(figures: BarrierFigures) -> list[Any]:
    facts = _facts(figures)
    shares = [value for did in DID for value in _columns(facts[did])]
    energy, height = facts["energy_j"], facts["height_over_ground_m"]
    return [
        figures.name, figures.height, figures.capacity, figures.came, *shares, energy["p95"], energy["max"],
        height["p95"], height["max"], facts["over_panel_m"]["max"],
    ]  # fmt: skip


def _columns(share: dict[str, Any]) -> list[Any]:
    return [share["rocks"], share["share"], *(share["interval_95"] or (None, None))]


def _text_row(figures: BarrierFigures) -> tuple[str, ...]:
    facts = _facts(figures)
    energy, height = facts["energy_j"]["p95"], facts["height_over_ground_m"]["p95"]
    counts = (figures.came, figures.caught, figures.broken_through, figures.flown_over)
    return (
        figures.name, *(f"{count:,}" for count in counts),
        "-" if energy is None else three_figures(energy / 1000.0), "-" if height is None else three_figures(height),
    )  # fmt: skip
