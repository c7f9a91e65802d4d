"""Choose colour scales for hazard maps, with round ends, the same in pictures and recordings.

Reach probability and energy span powers of ten, so their scales are logarithmic. Heights do not, so their scale is
linear.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.terrain.frame import FloatArray

COLOURS = np.array(
    [(255, 240, 150), (254, 200, 70), (247, 140, 40), (225, 70, 40), (170, 20, 70), (90, 0, 90)], dtype=float
)
"""Colours of a hazard map from low to high, sRGB (6, 3), evenly spaced.

The colours become steadily darker, so that a map can be read in greyscale and by colour-blind readers.
"""

FEW_COLOUR, FEW_WORDS = (125, 143, 179), f"reached by fewer than {FEWEST_ROCKS} rocks"
"""Colour (red, green, blue) of ground that rocks reached, but too few rocks for a value, and its words in a legend.

The colour is a blue that COLOURS does not have.
"""

LEAST_REACH = 1e-5
"""Lowest possible start of the scale of reach probability (-), so that the scale spans five powers of ten at most."""

LEAST_SHARE, MOST_SHARE = 1.0, 99.5
"""Percentiles of a map's values between which the colour scale lies, so that single cells do not stretch it."""

ROUND = (1.0, 2.0, 5.0, 10.0)
"""Numbers at which a colour scale may end, times a power of ten."""

FEW_DECADES = 1.7
"""Largest range (powers of ten) of a colour bar that also has tick labels between the powers."""
TOLERANCE = 1e-9
"""Relative distance (-) beyond an end of a colour bar at which a label still counts as at the end, despite rounding."""


Values = NDArray[np.floating[Any]]
"""Array of map values, in single or double precision."""


class Scale(NamedTuple):
    """A colour scale from the value `low` to the value `high`, in the unit of the map.

    logarithmic : True if colours are spaced by the logarithm of the value, False for a linear scale
    """

    low: float
    high: float
    logarithmic: bool


def round_steps(low: float, high: float) -> tuple[float, ...]:
    """Return the leading digits of the labels of a logarithmic colour bar from `low` to `high`: (1, 2, 5) or (1,).

    For (1, 2, 5), the labels are 1, 2 and 5 times each power of ten; for (1,), the powers of ten only. A bar with a
    range of at most FEW_DECADES (1.7) powers of ten has 1, 2 and 5.
    """
    return ROUND[:-1] if math.log10(high / low) <= FEW_DECADES else ROUND[:1]


def round_values(low: float, high: float) -> list[float]:
    """Return the labels of a logarithmic colour bar from low to high, in ascending order."""
    powers = range(math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 1)
    found = [step * 10.0**power for power in powers for step in round_steps(low, high)]
    return [value for value in found if low * (1.0 - TOLERANCE) <= value <= high * (1.0 + TOLERANCE)]


def reach_scale(flown: int, share: Values) -> Scale:
    """Return the colour scale of a map of reach probability (N,) (-), from `flown` rocks.

    The scale begins at a round share, at or below the share of one rock, but not below LEAST_REACH. It ends at a round
    share that no cell exceeds, and spans at least a power of ten.
    """
    low = max(LEAST_REACH, _rounded_down(1.0 / max(flown, 10)))
    most = float(share.max(initial=0.0, where=np.isfinite(share)))
    return Scale(low=low, high=min(1.0, max(10.0 * low, _rounded_up(most) if most > 0.0 else 1.0)), logarithmic=True)


def scale_of_energy(energy: Values) -> Scale:
    """Return the colour scale of a map of energy (N,) J, NaN if unknown; it spans at least a power of ten.

    Without a known energy above 0, the scale is 1 kJ to 1 MJ.
    """
    low, high = _range(energy)
    if high <= 0.0:
        return Scale(low=1e3, high=1e6, logarithmic=True)
    high = _rounded_up(high)
    return Scale(low=min(_rounded_down(max(low, 1e-4 * high)), high / 10.0), high=high, logarithmic=True)


def scale_of_passages(passages: Values) -> Scale:
    """Return the colour scale of a map of passages per metre (N,) 1/m, NaN if unknown.

    The scale spans at least a power of ten; without a known value above 0, it is 1e-5 to 1e-2 per metre.
    """
    low, high = _range(passages)
    if high <= 0.0:
        return Scale(low=1e-5, high=1e-2, logarithmic=True)
    high = _rounded_up(high)
    return Scale(low=min(_rounded_down(max(low, 1e-3 * high)), high / 10.0), high=high, logarithmic=True)


def scale_of_height(height: Values) -> Scale:
    """Return the colour scale of a map of heights (N,) m, NaN if unknown; it begins at 0.

    Without a known height above 0, the scale ends at 1 m.
    """
    _, high = _range(height)
    return Scale(low=0.0, high=_rounded_up(high) if high > 0.0 else 1.0, logarithmic=False)


def places(scale: Scale, values: Values) -> FloatArray:
    """Return the places (N,) of values (N,) on a colour scale, from 0 (low) to 1 (high); NaN stays NaN."""
    if not scale.logarithmic:
        return np.clip((values - scale.low) / (scale.high - scale.low), 0.0, 1.0)
    bounded = np.clip(values, scale.low, scale.high)
    return np.asarray(np.log(bounded / scale.low) / math.log(scale.high / scale.low))


def colours_at(place: FloatArray) -> NDArray[np.uint8]:
    """Return the sRGB colours (N, 3), 0 to 255, at places (N,) on a colour scale, 0 (low end) to 1 (high end)."""
    stops = np.linspace(0.0, 1.0, len(COLOURS))
    return np.stack([np.interp(place, stops, channel) for channel in COLOURS.T], axis=-1).round().astype(np.uint8)


def value_at(scale: Scale, place: float) -> float:
    """Return the value at a place on a colour scale, 0 to 1, in the unit of the map."""
    if scale.logarithmic:
        return float(scale.low * (scale.high / scale.low) ** place)
    return scale.low + (scale.high - scale.low) * place


def _range(values: Values) -> tuple[float, float]:
    """Return the range of nearly all known values of a map, between two percentiles; 0 to 0 if none is known.

    values : (N,), NaN if unknown. The percentiles are LEAST_SHARE and MOST_SHARE.
    """
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return 0.0, 0.0
    low, high = np.percentile(known, (LEAST_SHARE, MOST_SHARE))
    return float(low), float(high)


def _rounded_up(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return float(next(step for step in ROUND if step * power >= value * (1.0 - 1e-9)) * power)


def _rounded_down(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return float(next(step for step in reversed(ROUND) if step * power <= value * (1.0 + 1e-9)) * power)
