"""Logarithmic bins for percentiles: bounded memory, and the same result whatever the order of the rocks.

An octave has `PER_OCTAVE` bins. The logarithm of the mantissa 1 + x would cost ten times as much. So the bins have
equal widths in x + BEND x (1 - x) instead. It equals log2(1 + x) where 1 + x is 1, the square root of 2, or 2.
"""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.frame import FloatArray

PER_OCTAVE = 8
"""Bins per octave: the geometric middle of the widest bin lies 4.7 % from the bin's ends."""
FINE = 128
"""Bins per octave for zones and areas: they are few, and percentiles that must converge need a fine resolution."""
BEND = math.sqrt(2.0) / 4.0
"""Coefficient of the polynomial that replaces the logarithm of the mantissa (-)."""
MANTISSA = 2**52 - 1
"""Mask of the mantissa bits of a double-precision number; the bits above hold the exponent."""
SPEED_OCTAVES, HEIGHT_OCTAVES = 12, 17
"""Octaves of the bins of speed and height. In a pit 1 km across they resolve speeds from 0.06 m/s and heights from 8 mm
up; smaller values share the lowest bin."""
MOST_MASS_OCTAVES = 20
"""Most octaves for the range of masses, a million to one. Bins of energy cover these and twice the octaves of speed."""


class Scales(NamedTuple):
    """The largest energy (J), speed (m/s) and height (m) of the bins, the number of bins of each, and bins per octave.

    The largest speed and height are powers of two, so that scaling is exact. If all rocks have one mass and none
    spins, speed has no bins: percentiles of speed then follow from the percentiles of energy.
    """

    top: tuple[float, float, float]
    bins: tuple[int, int, int]
    per_octave: int


class Binning(NamedTuple):
    """The bins of all tallies of an ensemble.

    coarse : scales of squares and facets; fine : scales of zones and areas
    limit : most bytes for the bins of squares and facets together
    """

    coarse: Scales
    fine: Scales
    limit: float


def scales_of(
    drop: float,
    gravity: float,
    fastest: float,
    lightest: float,
    heaviest: float,
    per_octave: int = PER_OCTAVE,
    spins: bool = False,
) -> Scales:
    """Return the scales for rocks that fall at most `drop` (m) below their release.

    fastest : largest speed of release (m/s); lightest, heaviest : bounds of the rocks' masses (kg)
    per_octave : bins per octave; spins : True if energies include rotation, so that speeds need bins of their own
    """
    height = _power_of_two(drop + fastest * fastest / (2.0 * gravity))
    speed = _power_of_two(math.sqrt(fastest * fastest + 2.0 * gravity * height))
    masses = min(math.ceil(math.log2(heaviest / lightest)), MOST_MASS_OCTAVES)
    octaves = (2 * SPEED_OCTAVES + masses, SPEED_OCTAVES if masses or spins else 0, HEIGHT_OCTAVES)
    bins = (per_octave * octaves[0], per_octave * octaves[1], per_octave * octaves[2])
    return Scales(top=(0.5 * heaviest * speed * speed, speed, height), bins=bins, per_octave=per_octave)


@kernel
def bin_of(bits: int, bins: int, per_octave: int) -> int:
    """Return the number of the bin of a value >= 0, clamped to the first and the last bin.

    bits : the value, divided by the largest value of the bins: its double-precision bits, read as a whole number
    """
    x = (bits & MANTISSA) * 2.0**-52
    place = bins + ((bits >> 52) - 1023) * per_octave + math.floor(per_octave * (x + BEND * x * (1.0 - x)))
    return int(min(max(place, 0), bins - 1))


def bin_edges(top: float, bins: int, per_octave: int) -> FloatArray:
    """Return the edges (B + 1,) of B bins that reach up to top, ascending, in the unit of top: J, m/s or m."""
    octave, part = np.divmod(np.arange(bins + 1), per_octave)
    even = part / per_octave
    c = 1.0 + BEND
    x = (c - np.sqrt(c * c - 4.0 * BEND * even)) / (2.0 * BEND)
    edges: FloatArray = top * np.exp2(octave - bins / per_octave) * (1.0 + x)
    return edges


def bin_values(edges: FloatArray) -> FloatArray:
    """Return the value (B,) that represents each bin: the geometric middle of its edges (B + 1,), same unit."""
    return np.asarray(np.sqrt(edges[1:] * edges[:-1]))


def relative_error(edges: FloatArray) -> float:
    """Return the bound (-) of the relative error of the middle of a bin, from edges (B + 1,) of any unit."""
    return float(np.sqrt((edges[1:] / edges[:-1]).max()) - 1.0)


def _power_of_two(value: float) -> float:
    """Return the smallest power of two that is not below a value."""
    return float(2.0 ** math.ceil(math.log2(value)))
