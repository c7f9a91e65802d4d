"""The settings of a simulation besides terrain, materials and models: gravity, limits and seed."""

from typing import NamedTuple

from rpf3d_core.values import STANDARD_GRAVITY


class Settings(NamedTuple):
    """The settings of a simulation: gravity, the limits of a rock's path, and the seed; a scene file sets them.

    gravity : m/s^2
    smallest_bounce : height (m) below which a bounce is small. Small bounces are summed up instead of simulated, where
        possible (`settling.settle`). A rock on the ground slides on if a bounce would be small
    max_time : time (s) after the release at which a path ends
    max_impacts : largest number of impacts, meetings with obstacles and slides over facets, together; for a body, each
        time step in contact counts as a slide. It also limits the number of flight segments in air (`march.hovers`)
    seed : seed of all random numbers
    """

    gravity: float = STANDARD_GRAVITY
    smallest_bounce: float = 1e-3
    max_time: float = 3600.0
    max_impacts: int = 100_000
    seed: int = 1
