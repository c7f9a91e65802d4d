"""Write hazard/benches.csv: shares of rocks for each zone of the terrain and each area of interest."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rpf3d_core.hazard.benches import Bench
from rpf3d_core.hazard.by_source.each_source import SourceBenches

SHARES = ("reached", "stopped", "retained")
HEADER = [
    "kind",
    "name",
    *(f"{name}_{part}" for name in SHARES for part in ("rocks", "share", "low", "high")),
    "energy_p95_j",
    "lost_to_holes_rocks",
    "reached_at_most_share",
]
"""Columns of benches.csv.

`low` and `high` are the ends of the share's 95 % interval: Wilson's or, over parameter sets, the predictive interval.
`reached_at_most_share` counts every rock lost to a hole of the terrain as a rock that reached the place; it is empty if
no rock was lost.
"""


OF_SETS = [
    *(f"{name}_sampling_{end}" for name in SHARES for end in ("low", "high")),
    *(f"energy_p95_{kind}_{end}_j" for kind in ("predictive", "sampling") for end in ("low", "high")),
]
"""Further columns of a run over parameter sets: sampling intervals of shares, both intervals of p95 energies."""

OF_SOURCE = ["source", "source_rocks"]
"""Columns before those of benches.csv in sources.csv: name of the source, and number of its rocks that flew."""


def write_csv(path: Path, header: Sequence[str], lines: Iterable[Sequence[Any]]) -> None:
    """Write a table as a CSV file; a value of None becomes an empty cell."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(lines)


def share_columns(share: dict[str, Any]) -> list[Any]:
    """Return a share as four columns of a CSV file: rocks, share (-), and both ends (-) of its 95 % interval.

    share : from `share_of`; both ends are None if `interval_95` of the share is None
    """
    return [share["rocks"], share["share"], *(share["interval_95"] or (None, None))]


def write_benches(path: Path, benches: Sequence[Bench]) -> None:
    """Write benches.csv; a share whose total is 0 rocks is empty, and so is a percentile of fewer than 20 rocks."""
    sets = _has_predictive(benches)
    write_csv(path, _header(sets), (_whole_line(bench, sets) for bench in benches))


def write_sources(path: Path, tables: Sequence[SourceBenches]) -> None:
    """Write sources.csv: the rows of benches.csv for each source, with the columns OF_SOURCE before them.

    tables : the bench table of each source
    """
    sets = any(_has_predictive(table.benches) for table in tables)
    lines = ([table.name, table.rocks, *_whole_line(bench, sets)] for table in tables for bench in table.benches)
    write_csv(path, [*OF_SOURCE, *_header(sets)], lines)


def _has_predictive(benches: Sequence[Bench]) -> bool:
    """Return True if the rows of a bench table have predictive intervals over parameter sets."""
    return any(bench.energy_predictive for bench in benches)


def _header(sets: bool) -> list[str]:
    """Return the columns of benches.csv; sets : True for a run over parameter sets."""
    return [*HEADER, *OF_SETS] if sets else HEADER


def _whole_line(bench: Bench, sets: bool) -> list[Any]:
    """Return a row of benches.csv; sets : True for a run over parameter sets."""
    return [*_line(bench), *_sampling(bench)] if sets else _line(bench)


def _sampling(bench: Bench) -> list[Any]:
    """Return the values of a row of the bench table in the columns OF_SETS of benches.csv."""
    shares = [end for name in SHARES for end in getattr(bench, name)["sampling"] or (None, None)]
    return [*shares, *(bench.energy_predictive or ()), *(bench.energy_sampling or ())]


def _line(bench: Bench) -> list[Any]:
    shares = [value for name in SHARES for value in share_columns(getattr(bench, name))]
    lost = 0 if bench.lost is None else bench.lost["rocks"]
    most = None if bench.reached_at_most is None else bench.reached_at_most["share"]
    return [bench.kind, bench.name, *shares, bench.energy_p95, lost, most]
