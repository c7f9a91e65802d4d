"""Format numbers as text, with the ends of an interval rounded outward.

A printed interval then contains the computed interval. Rounded to the nearest digit, 0 to 2.4 % would become 0 to 2 %.
"""

import math
from collections.abc import Callable, Sequence
from typing import Literal

Side = Literal[-1, 0, 1]
"""Direction of rounding: LOW (down), NEAREST or HIGH (up)."""
LOW: Side = -1
NEAREST: Side = 0
HIGH: Side = 1
"""Rounding sides: LOW (down) for the lower end of an interval, HIGH (up) for the upper end, NEAREST for a value."""
EXACT = 1e-7
"""Largest relative difference (-) between a number and a rounded number up to which both count as equal.

The rounding error of 32-bit numbers is 6e-8.
"""
FROM = 99.9
"""Length (m) from which `short_length` has no decimal."""
TINY = 1e-9
"""Largest difference from a rounded number, in units of the last printed digit, up to which both count as equal.

This limit replaces EXACT for numbers near 0.
"""


def fixed(value: float, decimals: int, side: Side = NEAREST, sign: bool = False) -> str:
    """Return a number as text with a fixed number of decimals.

    decimals : number of digits after the point; side : rounding, LOW (down), NEAREST or HIGH (up)
    sign : True to write a plus sign before positive numbers
    """
    return f"{rounded(value, decimals, side):{'+' if sign else ''}.{decimals}f}"


def three_figures(value: float, side: Side = NEAREST) -> str:
    """Return a number as text with three significant digits, such as 0.0299 or 2,460.

    Only numbers below 0.0001 or from 10^12 on have an exponent, such as 1.2e-05.

    side : rounding, LOW (down), NEAREST or HIGH (up)
    """
    if side != NEAREST and value and math.isfinite(value):
        value = rounded(value, 2 - math.floor(math.log10(abs(value))), side)
    return f"{float(f'{value:.3g}'):,.12g}"


def short_length(value: float, side: Side = NEAREST) -> str:
    """Return a length (m) as text: with one decimal, such as 4.3; from FROM (99.9 m) on, with three significant digits.

    side : rounding, LOW (down), NEAREST or HIGH (up)
    """
    return fixed(value, 1, side) if abs(value) < FROM else three_figures(value, side)


def rounded(value: float, decimals: int, side: Side) -> float:
    """Return a number rounded down (LOW) or up (HIGH) to a number of decimals; NEAREST returns it unchanged.

    decimals : may be negative, such as -1 for tens. A number that is not finite is returned unchanged.
    """
    if side == NEAREST or not math.isfinite(value):
        return value
    scaled = value * 10.0**decimals
    tolerance = max(EXACT * abs(scaled), TINY)
    whole = math.floor(scaled + tolerance) if side == LOW else math.ceil(scaled - tolerance)
    return math.copysign(whole / 10.0**decimals, value)


def interval_as(
    ends: Sequence[float | None], text: Callable[[float, Side], str], unknown: str = "", between: str = "-"
) -> str:
    """Return an interval as text: its lower end is rounded down, its upper end up.

    ends : lower and upper end; text : function that turns an end into text, rounded down (LOW) or up (HIGH)
    unknown : text of an end that is None
    between : text between both ends
    """
    return between.join(
        unknown if end is None else text(end, side) for end, side in zip(ends, (LOW, HIGH), strict=True)
    )
