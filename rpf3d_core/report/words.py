"""Write numbers and intervals of a report as text; an unknown value becomes UNKNOWN."""

from collections.abc import Callable, Sequence
from typing import Any

from rpf3d_core.hazard.benches import in_percent, interval_in_percent, three_figures
from rpf3d_core.report.toe import FAR, Figure

UNKNOWN = "not known"
BEYOND_TERRAIN = "beyond the terrain"
ONE_DECIMAL = 1

Ends = Sequence[float | None] | None


def share(value: float | None) -> str:
    """Return a share in per cent as text."""
    return UNKNOWN if value is None else f"{in_percent(value, ONE_DECIMAL)} %"


def share_interval(ends: Ends) -> str:
    """Return the interval of a share in per cent as text; ends : lower and upper end (-), None if unknown."""
    if ends is None or ends[0] is None or ends[1] is None:
        return UNKNOWN
    return f"{interval_in_percent(ends[0], ends[1])} %"


def metres(value: float | None) -> str:
    """Return a length (m) as text; BEYOND_TERRAIN if it is at least FAR, because the rocks then did not stop."""
    if value is None:
        return UNKNOWN
    return BEYOND_TERRAIN if value >= FAR else f"{value:.1f} m"


def height(value: float | None) -> str:
    """Return a height (m) over the ground as text; UNKNOWN for None, and for at least FAR (an unknown height)."""
    return UNKNOWN if value is None or value >= FAR else f"{value:.1f} m"


def kilojoules(value: float | None) -> str:
    """Return an energy (J) in kJ as text."""
    return UNKNOWN if value is None else f"{three_figures(value / 1000.0)} kJ"


def interval(ends: Ends, words: Callable[[float | None], str]) -> str:
    """Return an interval as text; if only one end is known, "at least ..." or "at most ...".

    ends : lower and upper end, None if unknown; words : function that turns a number into text with its unit, such as
        `metres`
    """
    if ends is None or (ends[0] is None and ends[1] is None):
        return UNKNOWN
    if UNKNOWN in (words(ends[0]), words(ends[1])):
        return UNKNOWN if words(ends[0]) == words(ends[1]) else _one_sided(ends, words)
    return f"{words(ends[0])} to {words(ends[1])}"


def _one_sided(ends: Sequence[float | None], words: Callable[[float | None], str]) -> str:
    """Return an interval with one unknown end as text: "at most ..." or "at least ..."."""
    below = words(ends[0]) == UNKNOWN
    return f"at most {words(ends[1])}" if below else f"at least {words(ends[0])}"


def figure_cells(figure: Figure, words: Callable[[float | None], str]) -> list[str]:
    """Return a figure as three cells: value, predictive interval, sampling interval.

    words : function that turns a number into text with its unit, such as `metres`
    """
    return [words(figure.value), interval(figure.predictive, words), interval(figure.sampling, words)]


def share_cells(found: dict[str, Any]) -> list[str]:
    """Return a share as three cells: share, predictive interval, sampling interval; found : section of summary.json."""
    sampling = found.get("sampling", found["interval_95"])
    return [share(found["share"]), share_interval(found.get("predictive")), share_interval(sampling)]


def given(value: Any) -> str:
    """Return a value of a scene as text, for example a number, a distribution or a list."""
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "not given"}[value]
    if isinstance(value, int | float):
        return f"{value:,.10g}" if abs(value) < 1e15 else f"{value:g}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {given(item)}" for key, item in value.items() if item is not None)
    if isinstance(value, list):
        return f"[{', '.join(given(item) for item in value)}]"
    return str(value)
