"""The settings of a simulation besides terrain, materials and models: gravity, limits and seed."""

from typing import NamedTuple

from rpf3d_core.values import STANDARD_GRAVITY


class Settings(NamedTuple):
    """The settings of a simulation: gravity, the limits of a rock's path, and the seed; a scene file sets them.

    gravity : m/s^2
    smallest_bounce : m; a bounce that would rise less is not simulated: it is summed up with all later bounces, or the
        rock slides on
    max_time : longest time of a path (s)
    max_impacts : largest number of impacts, meetings with obstacles and slides over facets, together; also limits the
        number of flight segments in air
    seed : seed of all random numbers
    """

    gravity: float = STANDARD_GRAVITY
    smallest_bounce: float = 1e-3
    max_time: float = 3600.0
    max_impacts: int = 100_000
    seed: int = 1
