"""Sort energies, speeds and heights into logarithmic bins, from which percentiles follow without storing each rock.

Bins need bounded memory, and give the same result whatever the order of the rocks. An octave (a factor of 2) has
`PER_OCTAVE` bins for map cells and facets, and `FINE` bins for zones and areas. A value is (1 + x) times a power of
two. Within an octave, all bins are equally wide on the scale of x + BEND x (1 - x). This polynomial replaces
log2(1 + x), which takes ten times as long; both are equal where 1 + x is 1, the square root of 2, or 2.
"""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.frame import FloatArray

PER_OCTAVE = 8
"""Number of bins per octave: a percentile is then wrong by 4.7 % at most.

This is the relative distance from the geometric middle of the widest bin to its ends.
"""
FINE = 128
"""Number of bins per octave for zones and areas, which are few and need finer percentiles to judge convergence."""
BEND = math.sqrt(2.0) / 4.0
"""Coefficient (-) of the polynomial that replaces the logarithm, because the polynomial is faster."""
MANTISSA = 2**52 - 1
"""Mask of the mantissa bits of a double-precision number; the bits above the mask are the exponent."""
SPEED_OCTAVES, HEIGHT_OCTAVES = 12, 17
"""Range of the bins of speed and of height, in octaves below the largest value.

In a pit 1 km deep, speeds from 0.06 m/s and heights from 8 mm up have separate bins; smaller values share the lowest
bin.
"""
MOST_MASS_OCTAVES = 20
"""Largest range of masses that bins of energy cover, in octaves: a million to one.

Bins of energy cover these octaves, and twice the octaves of speed.
"""


class Scales(NamedTuple):
    """The bins of energy (J), speed (m/s) and height (m), in this order.

    top : largest value of each quantity; the largest speed and height are powers of two, so that scaling is exact
    bins : number of bins of each quantity. If all rocks have one mass and none spins, speed has no bins: percentiles of
        speed then follow from the percentiles of energy.
    per_octave : number of bins over which values double
    """

    top: tuple[float, float, float]
    bins: tuple[int, int, int]
    per_octave: int


class Binning(NamedTuple):
    """The bins of all hazard maps of an ensemble: how fine they are, and how much memory they may take.

    coarse : bins of map cells and facets; fine : bins of zones and areas
    limit : memory (bytes) for the counts of map cells and facets, half for each; bins are merged in pairs to stay below
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
    """Return the bins that cover all energies, speeds and heights of rocks that fall at most `drop` (m).

    drop : largest fall of a rock below its release (m); gravity : m/s^2; fastest : largest speed of release (m/s)
    lightest, heaviest : bounds of the rocks' masses (kg)
    per_octave : bins per octave; spins : True if energies include rotation, so that speeds need separate bins
    """
    height = _power_of_two(drop + fastest * fastest / (2.0 * gravity))
    speed = _power_of_two(math.sqrt(fastest * fastest + 2.0 * gravity * height))
    masses = min(math.ceil(math.log2(heaviest / lightest)), MOST_MASS_OCTAVES)
    octaves = (2 * SPEED_OCTAVES + masses, SPEED_OCTAVES if masses or spins else 0, HEIGHT_OCTAVES)
    bins = (per_octave * octaves[0], per_octave * octaves[1], per_octave * octaves[2])
    return Scales(top=(0.5 * heaviest * speed * speed, speed, height), bins=bins, per_octave=per_octave)


@kernel
def bin_of(bits: int, bins: int, per_octave: int) -> int:
    """Return the number of the bin that a value >= 0 belongs to, at least 0 and at most the last bin.

    bits : the value divided by the largest value of the bins, as a double whose 64 bits are read as a whole number
    bins : number of bins; per_octave : number of bins over which values double
    """
    x = (bits & MANTISSA) * 2.0**-52
    place = bins + ((bits >> 52) - 1023) * per_octave + math.floor(per_octave * (x + BEND * x * (1.0 - x)))
    return int(min(max(place, 0), bins - 1))


def bin_edges(top: float, bins: int, per_octave: int) -> FloatArray:
    """Return the edges (B + 1,) of B bins in ascending order, up to `top`, in the unit of `top`.

    per_octave : number of bins over which values double
    """
    octave, part = np.divmod(np.arange(bins + 1), per_octave)
    even = part / per_octave
    c = 1.0 + BEND
    x = (c - np.sqrt(c * c - 4.0 * BEND * even)) / (2.0 * BEND)
    edges: FloatArray = top * np.exp2(octave - bins / per_octave) * (1.0 + x)
    return edges


def bin_values(edges: FloatArray) -> FloatArray:
    """Return for each of B bins the value (B,) that represents the bin: the geometric mean of its two edges.

    edges : (B + 1,) edges of the bins, ascending; the result has the same unit
    """
    return np.asarray(np.sqrt(edges[1:] * edges[:-1]))


def relative_error(edges: FloatArray) -> float:
    """Return the largest relative error (-) of a percentile that is read from bins with these edges (B + 1,)."""
    return float(np.sqrt((edges[1:] / edges[:-1]).max()) - 1.0)


def _power_of_two(value: float) -> float:
    """Return the smallest power of two that is not below a value."""
    return float(2.0 ** math.ceil(math.log2(value)))
