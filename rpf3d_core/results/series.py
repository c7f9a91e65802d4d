"""Series of points of the price list of accuracy, as pictures and recordings draw them."""

from collections.abc import Sequence
from typing import NamedTuple

Colour = tuple[int, int, int]

LEAST = 1e-4
"""Smallest drawn error (-), because a logarithmic axis has no 0; the label of a point then shows the error as text."""


class Series(NamedTuple):
    """One series of S points in the plot of error against computing time, such as one method with several time steps.

    kind : numerical, geometric or statistical; colour : red, green, blue, each up to 255
    seconds : (S,) s; errors : (S,) (-), above 0; words : (S,) labels next to the points
    compiled : (S,) s, times of the same steps with the compiled engine, if `seconds` are times of the thesis' method
    """

    name: str
    kind: str
    colour: Colour
    seconds: Sequence[float]
    errors: Sequence[float]
    words: Sequence[str]
    compiled: Sequence[float] | None = None
