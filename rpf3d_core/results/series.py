"""Series of points to be drawn and recorded: what the price list of accuracy hands to those who do."""

from collections.abc import Sequence
from typing import NamedTuple

Colour = tuple[int, int, int]


class Series(NamedTuple):
    """S points of one kind.

    kind : numerical, geometric or statistical; colour : red, green, blue, each up to 255
    seconds (S,); errors (S,) (-), above 0; words (S,) beside the points
    compiled : (S,) seconds of steps taken by the compiled engine, where `seconds` are those of the thesis' way
    """

    name: str
    kind: str
    colour: Colour
    seconds: Sequence[float]
    errors: Sequence[float]
    words: Sequence[str]
    compiled: Sequence[float] | None = None
