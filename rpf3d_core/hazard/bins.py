"""Logarithmic bins: what percentiles are told from, in bounded memory and the same whatever the order of the rocks.

An octave has `PER_OCTAVE` bins. Instead of the logarithm of the mantissa 1 + x, which costs ten times as much, they
are even in x + BEND x (1 - x), which equals log2(1 + x) at 0, at the square root of 2 and at 1.
"""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.compiling import kernel
from rpf3d_core.terrain.frame import FloatArray

PER_OCTAVE = 8
"""Bins an octave: the geometric middle of the widest lies 4.7 % from its ends."""
FINE = 128
"""Bins an octave for zones and areas, which are few: percentiles that are to hold still must be told finely."""
BEND = math.sqrt(2.0) / 4.0
MANTISSA = 2**52 - 1
"""Its bits in a number of double precision; the exponent stands above them."""
SPEED_OCTAVES, HEIGHT_OCTAVES = 12, 17
"""In a pit 1 km across rocks are told apart from 0.06 m/s and 8 mm on; slower and lower ones count as at most that."""
MOST_MASS_OCTAVES = 20
"""Energies are told apart over twice the octaves of speed, and over those of the masses, at most a million to one."""


class Scales(NamedTuple):
    """The largest energy (J), speed (m/s) and height (m) that bins tell apart, how many bins each has, and an octave.

    Those of speed and height are powers of two, so that scaling rounds nothing. Where all rocks have one
    mass and none spins, speed has no bins: its percentiles are told from those of the energy.
    """

    top: tuple[float, float, float]
    bins: tuple[int, int, int]
    per_octave: int


def scales_of(
    drop: float,
    gravity: float,
    fastest: float,
    lightest: float,
    heaviest: float,
    per_octave: int = PER_OCTAVE,
    spins: bool = False,
) -> Scales:
    """Scales for rocks that fall no deeper than `drop` (m) from where they are released, no faster than `fastest`.

    fastest : m/s; lightest, heaviest : bounds of their masses (kg); per_octave : bins
    spins : whether energies count rotation, so that speeds need bins of their own
    """
    height = _power_of_two(drop + fastest * fastest / (2.0 * gravity))
    speed = _power_of_two(math.sqrt(fastest * fastest + 2.0 * gravity * height))
    masses = min(math.ceil(math.log2(heaviest / lightest)), MOST_MASS_OCTAVES)
    octaves = (2 * SPEED_OCTAVES + masses, SPEED_OCTAVES if masses or spins else 0, HEIGHT_OCTAVES)
    bins = (per_octave * octaves[0], per_octave * octaves[1], per_octave * octaves[2])
    return Scales((0.5 * heaviest * speed * speed, speed, height), bins, per_octave)


@kernel
def bin_of(bits: int, bins: int, per_octave: int) -> int:
    """The bin of a value >= 0 over the largest that `bins` reach up to: 0 holds what is lower, the last what is higher.

    bits : of the value in double precision, as a whole number: its exponent and its mantissa are read off
    """
    x = (bits & MANTISSA) * 2.0**-52
    place = bins + ((bits >> 52) - 1023) * per_octave + math.floor(per_octave * (x + BEND * x * (1.0 - x)))
    return int(min(max(place, 0), bins - 1))


def bin_edges(top: float, bins: int, per_octave: int) -> FloatArray:
    """Edges (B + 1,) of B bins that reach up to top, from below, in its unit: J, m/s or m."""
    octave, part = np.divmod(np.arange(bins + 1), per_octave)
    even = part / per_octave
    c = 1.0 + BEND
    x = (c - np.sqrt(c * c - 4.0 * BEND * even)) / (2.0 * BEND)
    edges: FloatArray = top * np.exp2(octave - bins / per_octave) * (1.0 + x)
    return edges


def bin_values(edges: FloatArray) -> FloatArray:
    """What a value in each bin (B,) is told as: the geometric middle of its edges (B + 1,)."""
    return np.asarray(np.sqrt(edges[1:] * edges[:-1]))


def relative_error(edges: FloatArray) -> float:
    """Bound (-) of the relative error of a value told as the middle of its bin, from edges (B + 1,) of any unit."""
    return float(np.sqrt((edges[1:] / edges[:-1]).max()) - 1.0)


def _power_of_two(value: float) -> float:
    """The smallest power of two that is not below a value."""
    return float(2.0 ** math.ceil(math.log2(value)))
