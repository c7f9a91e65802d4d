"""Series of points that pictures and recordings draw: error and computing time of settings, and results of a sweep."""

from collections.abc import Sequence
from typing import Any, NamedTuple

Colour = tuple[int, int, int]

LEAST = 1e-4
"""Smallest error (-) that is drawn, because a logarithmic axis has no 0; smaller errors are drawn as this value."""


class Series(NamedTuple):
    """One series of S points in the plot of error against computing time, such as one method with several time steps.

    name : for the legend; kind : kind of the error: numerical, geometric or statistical
    colour : red, green, blue, each up to 255
    seconds : (S,) s; errors : (S,) (-), at least LEAST; words : (S,) labels next to the points
    compiled : (S,) s, for the thesis' method: times of the compiled engine with the same steps as in `seconds`. None
        for other series
    """

    name: str
    kind: str
    colour: Colour
    seconds: Sequence[float]
    errors: Sequence[float]
    words: Sequence[str]
    compiled: Sequence[float] | None = None


class Curve(NamedTuple):
    """One curve of a panel of a sweep, with P points.

    name : label, "" for a single curve; at : (P,) values of the varied key, numbers or other values
    values, low, high : (P,) result and ends of its 95 % interval, in the unit of the panel's axis; None if unknown
    is_predictive : True for predictive intervals, which a point may lack; False for sampling intervals
    """

    name: str
    at: Sequence[Any]
    values: Sequence[float | None]
    low: Sequence[float | None]
    high: Sequence[float | None]
    is_predictive: bool


class Panel(NamedTuple):
    """One panel of the picture of a sweep.

    title : of the panel; axis : label of the upright axis, with the unit
    curves : one for each combination of the values of all varied keys but the first
    unknown : text in place of the curves if no value is known
    """

    title: str
    axis: str
    curves: Sequence[Curve]
    unknown: str = "not known"
