"""Show a comparison of two runs as tables of text, on the screen or in Markdown."""

import math
from collections.abc import Sequence

from rpf3d_core.ensemble.outward import fixed, interval_as, three_figures
from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.benches import AREA
from rpf3d_core.runs.compare import LEVEL, Comparison, Counted, Energies, ShareDifference

SHARES_HEADER = ("place", "share", "A", "B", "B - A in points", "p", "p (Holm)", "significant")
ENERGIES_HEADER = ("place", "p95 energy A (kJ)", "B (kJ)", "B / A")
SMALLEST_P = 1e-4
"""Smallest p value that is printed in digits; smaller values are printed as "< 0.0001"."""

Rows = list[tuple[str, ...]]


def share_rows(comparison: Comparison) -> Rows:
    """Return the rows of the table of shares in two runs A and B, as text.

    Columns: place, name of the share, A, B, B - A (percentage points), p, p after Holm's correction, significant
    ("yes", "no" or "alone"). "alone" means: significant if tested alone, but not after Holm's correction.
    """
    return [_share_row(row) for row in comparison.differences]


def energy_rows(comparison: Comparison) -> Rows:
    """Return the rows of the table of energies in two runs A and B, as text.

    Columns: place, p95 energy in A and in B (kJ), ratio B / A. The table has only the places with a percentile in at
    least one run.
    """
    known = [row for row in comparison.energies if row.a is not None or row.b is not None]
    return [(_name(row.kind, row.place), _kilojoule(row.a), _kilojoule(row.b), _ratio(row)) for row in known]


def lines_of(comparison: Comparison) -> list[str]:
    """Return the lines above the tables of a comparison: the two runs, places in one run only, and notes."""
    lines = [
        f"{name}: {facts['scene'].get('file')}, seed {facts['scene'].get('seed')}, {facts['rocks']:,} rocks"
        for name, facts in (("A", comparison.a), ("B", comparison.b))
    ]
    for name, places in comparison.only.items():
        if places:
            lines.append(f"only in {name.upper()}: {', '.join(_name(*place) for place in places)}")
    return [*lines, *comparison.notes]


def markdown_of(comparison: Comparison) -> str:
    """Return a comparison as a section of Markdown, for a report."""
    head = "\n".join(f"- {line}" for line in lines_of(comparison))
    shares = markdown_table(SHARES_HEADER, share_rows(comparison))
    return f"{head}\n\n{shares}\n\n{markdown_table(ENERGIES_HEADER, energy_rows(comparison))}\n"


def markdown_table(header: Sequence[str], rows: Rows) -> str:
    """Return a header and rows as a table in Markdown."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (header, ["---"] * len(header), *rows))


def percent(counted: Counted, decimals: int = 0) -> str:
    """Return a share in per cent with its 95 % interval as text for a table; decimals : fewest decimals."""
    decimals = max(decimals, decimals_of(counted))
    ends = interval_as(
        wilson_interval(*counted), lambda end, side: fixed(100.0 * end, decimals, side), between=" to "
    )  # fmt: skip
    return f"{100 * counted.share:.{decimals}f} % ({ends})"


def decimals_of(counted: Counted) -> int:
    """Return the number of decimals that a share in per cent needs, so that the ends of its 95 % interval differ."""
    low, high = wilson_interval(*counted)
    return decimals_for(high - low)


def points(change: float, interval: tuple[float, float], decimals: int = 0) -> str:
    """Return a difference of two shares (-) with its interval as text for a table, in percentage points.

    change, interval : the difference and the ends of its interval (-)
    decimals : fewest decimals; more are written if the interval needs them
    """
    decimals = max(decimals, decimals_for(interval[1] - interval[0]))
    ends = interval_as(interval, lambda end, side: fixed(100.0 * end, decimals, side, sign=True), between=" to ")
    return f"{100 * change:+.{decimals}f} ({ends})"


def decimals_for(width: float) -> int:
    """Return the number of decimals (1 to 4) that a share in per cent needs to show an interval of the share.

    width : of the interval (-)
    """
    return 4 if width <= 0.0 else min(max(1, math.ceil(-math.log10(100.0 * width))), 4)


def p_text(p: float) -> str:
    """Return a p value as text with two significant digits; "< 0.0001" for a value below SMALLEST_P (0.0001)."""
    return f"< {SMALLEST_P:g}" if p < SMALLEST_P else f"{p:.2g}"


def _share_row(row: ShareDifference) -> tuple[str, ...]:
    verdict = "no" if not row.significant else "yes" if row.p_holm < LEVEL else "alone"
    # With fewer decimals, the larger of two shares could look like the smaller one: 0.02 % and 0.0 % for 0.05 %.
    decimals = max(decimals_of(row.a), decimals_of(row.b))
    a, b, change = percent(row.a, decimals), percent(row.b, decimals), points(row.change, row.interval, decimals)
    place = _name(row.kind, row.place)
    return (place, row.measure, a, b, change, p_text(row.p), p_text(row.p_holm), verdict)


def _name(kind: str, place: str) -> str:
    return f"{place} (area)" if kind == AREA else place


def _kilojoule(energy: float | None) -> str:
    return "-" if energy is None else three_figures(energy / 1000.0)


def _ratio(row: Energies) -> str:
    return f"{row.b / row.a:.2f}" if row.a and row.b is not None else "-"
