"""Compute the sizes of rocks: equal for all, or drawn by diameter, mass or volume.

The radius of a rock is the radius of a sphere of the same volume.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rpf3d_core.ensemble.bodies import DrawnBody, shape_numbers
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.materials.distributions import FEW, Distribution, Measured, quantiles
from rpf3d_core.materials.streams import Purpose, uniform
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Rock

UNIT_SPHERE_VOLUME = 4.0 / 3.0 * math.pi
"""Volume of a sphere of radius 1 m (m^3)."""


@dataclass(frozen=True)
class DrawnRock:
    """Rocks of one density (kg/m^3) whose size is drawn at random.

    measure : the drawn quantity: diameter (m), mass (kg) or volume (m^3)
    """

    density: float
    measure: str
    size: Distribution | Measured


@dataclass(frozen=True)
class SourceRocks:
    """Rocks whose size depends on their source.

    rocks : for each source a `Rock` or a `DrawnRock`; None if each rock of the source has the volume of its shape
    """

    rocks: tuple[Rock | DrawnRock | None, ...]


AnyRock = Rock | DrawnRock | SourceRocks | DrawnBody
"""The rocks of a scene: all alike, or a description from which sizes, and shapes, are drawn."""


def sizes_of(rock: AnyRock, seed: int, source: ArrayLike, rocks: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Return the masses (R,) kg and radii (R,) m of rocks, from the rocks' numbers within their sources (R,).

    rock : the rocks of the scene; rocks : (R,) numbers of the rocks in their source
    source : number of the source: a single number for all rocks, or (R,) one for each rock; with `SourceRocks` only a
        single number
    """
    if isinstance(rock, SourceRocks):
        return sizes_of(_of_source(rock, source), seed, source, rocks)
    if isinstance(rock, DrawnBody):
        size = _of_source(rock.size, source) if isinstance(rock.size, SourceRocks) else rock.size
        if size is not None:
            return sizes_of(size, seed, source, rocks)
        volume = rock.volumes[shape_numbers(rock, seed, source, rocks)]
        return rock.density * volume, _radii(volume)
    if isinstance(rock, Rock):
        return np.full(len(rocks), rock.mass), np.full(len(rocks), rock.radius)
    size = quantiles(rock.size, uniform(seed, source, rocks, Purpose.ROCK_SIZE))
    if rock.measure == "diameter":
        radius = 0.5 * size
        return rock.density * UNIT_SPHERE_VOLUME * (radius * radius * radius), radius
    mass = size if rock.measure == "mass" else rock.density * size
    return mass, _radii(mass / rock.density)


def mass_range(rock: AnyRock) -> tuple[float, float]:
    """Return the smallest and the largest mass (kg) that a rock of any source can have."""
    if isinstance(rock, SourceRocks):
        return _whole_range([mass_range(each) for each in rock.rocks if each is not None])
    if isinstance(rock, DrawnBody):
        own = rock.density * float(rock.volumes.min()), rock.density * float(rock.volumes.max())
        sizes = rock.size.rocks if isinstance(rock.size, SourceRocks) else (rock.size,)
        return _whole_range([own if size is None else mass_range(size) for size in sizes])
    if isinstance(rock, Rock):
        return rock.mass, rock.mass
    bounds = (rock.size.low, rock.size.high)
    if rock.measure == "diameter":
        low, high = (rock.density * UNIT_SPHERE_VOLUME * (0.5 * bound) ** 3 for bound in bounds)
    else:
        low, high = (bound if rock.measure == "mass" else rock.density * bound for bound in bounds)
    return low, high


def _of_source(rock: SourceRocks, source: ArrayLike) -> Any:
    """Return the size of the rocks of one source, as in `SourceRocks`; None if each rock has the volume of its shape.

    source : number of the source
    """
    return rock.rocks[int(np.asarray(source))]


def _whole_range(ranges: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the smallest and the largest number of several ranges (low, high)."""
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def diameter_of(mass: FloatArray | float, density: float) -> Any:
    """Return the diameters (R,) m of rocks as spheres, from their masses (R,) kg and density (kg/m^3).

    A single mass gives a single number.
    """
    return 2.0 * np.cbrt(np.asarray(mass) / (density * UNIT_SPHERE_VOLUME))


def _radii(volume: FloatArray) -> FloatArray:
    """Return the radii (R,) m of rocks as spheres, from their volumes (R,) m^3."""
    radius = np.empty(len(volume))
    if len(volume) <= FEW:
        _radius_all.py_func(volume.tolist(), radius)  # type: ignore[attr-defined]
    else:
        _radius_all(volume, radius)
    return radius


@loop
def _radius_all(volume: FloatArray, radius: FloatArray) -> None:
    """Write the radii (R,) m of spheres with given volumes.

    This is a loop, because the last bit of NumPy's powers depends on the number of values.
    """
    for i in range(len(radius)):
        radius[i] = (volume[i] / UNIT_SPHERE_VOLUME) ** (1.0 / 3.0)
