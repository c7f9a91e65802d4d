"""Write numbers as text; the ends of an interval are rounded outward.

A printed interval then contains the computed interval. Rounded to the nearest digit, 0 to 2.4 % would become 0 to 2 %.
"""

import math
from collections.abc import Callable, Sequence
from typing import Literal

Side = Literal[-1, 0, 1]
"""Which way a number is rounded: LOW (down), NEAREST or HIGH (up)."""
LOW: Side = -1
NEAREST: Side = 0
HIGH: Side = 1
"""Sides: LOW for the lower end of an interval, HIGH for the upper end, NEAREST for a value."""
EXACT = 1e-7
"""Relative difference (-) up to which a number counts as the rounded number: 32-bit numbers differ by 6e-8."""
TINY = 1e-9
"""Such a difference in units of the last printed digit, for numbers next to 0."""


def fixed(value: float, decimals: int, side: Side = NEAREST, sign: bool = False) -> str:
    """Return a number as text with a number of decimals; sign : True to write the sign of positive numbers also."""
    return f"{rounded(value, decimals, side):{'+' if sign else ''}.{decimals}f}"


def three_figures(value: float, side: Side = NEAREST) -> str:
    """Return a number as text with three significant digits and without exponent, such as 0.0299 or 2,460."""
    if side != NEAREST and value and math.isfinite(value):
        value = rounded(value, 2 - math.floor(math.log10(abs(value))), side)
    return f"{float(f'{value:.3g}'):,.12g}"


def rounded(value: float, decimals: int, side: Side) -> float:
    """Return a number rounded down, up, or not at all (NEAREST); decimals : may be negative, such as -1 for tens."""
    if side == NEAREST or not math.isfinite(value):
        return value
    scaled = value * 10.0**decimals
    tolerance = max(EXACT * abs(scaled), TINY)
    whole = math.floor(scaled + tolerance) if side == LOW else math.ceil(scaled - tolerance)
    return math.copysign(whole / 10.0**decimals, value)


def interval_as(
    ends: Sequence[float | None], text: Callable[[float, Side], str], unknown: str = "", between: str = "-"
) -> str:
    """Return an interval as text, its ends rounded outward.

    text : function that turns a number into text, rounded to a side; unknown : text of an end that is None
    between : text between both ends
    """
    return between.join(
        unknown if end is None else text(end, side) for end, side in zip(ends, (LOW, HIGH), strict=True)
    )
