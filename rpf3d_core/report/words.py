"""Write numbers and intervals of a report as text; an unknown value becomes UNKNOWN."""

from collections.abc import Sequence
from typing import Any, Protocol

from rpf3d_core.ensemble.outward import HIGH, LOW, NEAREST, Side, short_length, three_figures
from rpf3d_core.ensemble.statistics import sampling_of
from rpf3d_core.hazard.benches import in_percent, interval_in_percent
from rpf3d_core.report.toe import FAR, ResultWithIntervals

UNKNOWN = "not known"
FARTHER = "farther than known"
"""Text for a distance that is only known to be larger than all others, because the rocks did not stop."""
ONE_DECIMAL = 1

Ends = Sequence[float | None] | None


class Words(Protocol):
    """A function that turns a number into text with its unit, rounded up, down or to the nearest; UNKNOWN for None."""

    def __call__(self, value: float | None, side: Side = NEAREST) -> str:
        """Return the number as text; side : direction of the rounding: NEAREST, LOW (down) or HIGH (up)."""


def share(value: float | None) -> str:
    """Return a share (-) as text in per cent; UNKNOWN for None."""
    return UNKNOWN if value is None else f"{in_percent(value, ONE_DECIMAL)} %"


def share_interval(ends: Ends) -> str:
    """Return the interval of a share as text in per cent; UNKNOWN if an end is None.

    ends : lower and upper end (-), None for an unknown end, or None if both are unknown
    """
    if ends is None or ends[0] is None or ends[1] is None:
        return UNKNOWN
    return f"{interval_in_percent(ends[0], ends[1])} %"


def metres(value: float | None, side: Side = NEAREST) -> str:
    """Return a length (m) as text; UNKNOWN for None, FARTHER for FAR (1e6 m) or more, if rocks did not stop.

    side : rounding: NEAREST, LOW (down) or HIGH (up)
    """
    if value is None:
        return UNKNOWN
    return FARTHER if value >= FAR else f"{short_length(value, side)} m"


def height(value: float | None, side: Side = NEAREST) -> str:
    """Return a height (m) over the ground as text; UNKNOWN for None and for FAR or more.

    side : rounding: NEAREST, LOW (down) or HIGH (up)
    """
    return UNKNOWN if value is None or value >= FAR else f"{short_length(value, side)} m"


def kilojoules(value: float | None, side: Side = NEAREST) -> str:
    """Return an energy (J) as text in kJ, with three significant digits; UNKNOWN for None.

    side : rounding: NEAREST, LOW (down) or HIGH (up)
    """
    return UNKNOWN if value is None else f"{three_figures(value / 1000.0, side)} kJ"


NEVER_BELOW_0: tuple[Words, ...] = (height, kilojoules)
"""Functions for quantities that cannot be negative."""


def interval(ends: Ends, words: Words) -> str:
    """Return an interval as text, rounded outward; if only one end is known, "at least ..." or "at most ...".

    A lower end with the text FARTHER counts as an end that is not known. If no end is known, the result is the text of
    the lower end: UNKNOWN or FARTHER. A lower end of 0 of a height or an energy is no information, because neither can
    be below 0: without an upper end, the result is then UNKNOWN. A distance beyond the toe (`metres`) can be below 0.

    ends : lower and upper end, None for an unknown end, or None if both are unknown
    words : function that turns a number into text with its unit, such as `metres`
    """
    if ends is None:
        return UNKNOWN
    low, high = words(ends[0], LOW), words(ends[1], HIGH)
    if low in (UNKNOWN, FARTHER):
        return low if high in (UNKNOWN, FARTHER) else f"at most {high}"
    if high != UNKNOWN:
        return f"{low} to {high}"
    return UNKNOWN if words in NEVER_BELOW_0 and low == words(0.0, LOW) else f"at least {low}"


def figure_cells(figure: ResultWithIntervals, words: Words) -> list[str]:
    """Return a figure as three cells: value, predictive interval, sampling interval; words : as in `interval`."""
    return [words(figure.value), interval(figure.predictive, words), interval(figure.sampling, words)]


def share_cells(found: dict[str, Any]) -> list[str]:
    """Return a share as three cells: share, predictive interval, sampling interval; found : section of summary.json."""
    return [share(found["share"]), share_interval(found.get("predictive")), share_interval(sampling_of(found))]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def given(value: Any) -> str:
    """Return a value of a scene as text, for example a number, a distribution or a list."""
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "not given"}[value]
    if isinstance(value, int | float):
        return f"{value:,.10g}" if abs(value) < 1e15 else f"{value:g}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {given(item)}" for key, item in value.items() if item is not None)
    if isinstance(value, list):
        return f"[{', '.join(f'{item:.10g}' if _is_number(item) else given(item) for item in value)}]"
    return str(value)
