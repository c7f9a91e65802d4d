"""The pit of the campaign (`campaign.py`): a slope above a road, and a bank that protects one half of the road.

The pit lies far from the origin of the map. Therefore a wrong unit, a wrong sign or exchanged axes move the places in a
message off the terrain, under the ground or high above the ground.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

ORIGIN = np.array([1200.0, 3400.0, 500.0])
"""Corner of the pit in the map frame, at the level of the floor (m)."""

LENGTH, WIDTH, DROP, STEP = 72.0, 80.0, 40.0, 2.0
"""The slope of 45 degrees falls along x from 0 to DROP (m), then the floor is level; STEP is the spacing of points."""

BANK_FROM, BANK_HEIGHT = 40.0, 14.0
"""The bank stands at the toe of the slope where y is above BANK_FROM (m); BANK_HEIGHT is its height (m)."""

THROW = (-15.0, 0.0, 0.0)
"""Velocity (m/s) of a thrown source, which lies beyond the road; its rocks cross the road."""

OPEN, SHELTERED = (12.0, 30.0), (54.0, 68.0)
"""Ranges of y (m) of sources above the unprotected half of the road, and above the bank."""

ROAD = ((44.0, 2.0), (52.0, 2.0), (52.0, 78.0), (44.0, 78.0))
"""Corners (m) of the road at the toe, relative to ORIGIN."""

SHELTERED_ROAD = ((44.0, 44.0), (52.0, 44.0), (52.0, 78.0), (44.0, 78.0))
"""Corners (m) of the part of the road behind the bank."""


def surface(x: FloatArray, y: FloatArray, has_bank: bool) -> FloatArray:
    """Return the heights (m) of the true ground above the floor, at places x, y (m) relative to ORIGIN."""
    bank = np.where(has_bank & (y > BANK_FROM) & (np.abs(x - 41.0) <= 1.5), BANK_HEIGHT, 0.0)
    return np.asarray(np.maximum(DROP - x, 0.0) + bank)


def survey(has_bank: bool) -> FloatArray:
    """Return the points (rows, columns, 3) m of a correct survey of the whole pit, map frame."""
    return patch_of(has_bank, (0.0, LENGTH), (0.0, WIDTH))


def patch_of(has_bank: bool, x: tuple[float, float], y: tuple[float, float]) -> FloatArray:
    """Return the points (rows, columns, 3) m of a correct survey of a part of the pit, map frame.

    x, y : ranges relative to ORIGIN (m)
    """
    rows, columns = np.mgrid[y[0] : y[1] + 0.1 : STEP, x[0] : x[1] + 0.1 : STEP]
    return np.stack([columns, rows, surface(columns, rows, has_bank)], axis=-1) + ORIGIN


def placed(x: float, y: float, z: float) -> FloatArray:
    """Return a place (3,) m in the map frame, from its coordinates relative to ORIGIN (m)."""
    return ORIGIN + np.array([x, y, z])


def on_the_slope(rng: np.random.Generator, y: tuple[float, float]) -> FloatArray:
    """Return a random place (3,) m of a source 1 m above the slope, map frame.

    y : range relative to ORIGIN (m)
    """
    x, across = rng.uniform(6.0, 16.0), rng.uniform(*y)
    return placed(x, across, DROP - x + 1.0)


def on_the_floor(rng: np.random.Generator) -> FloatArray:
    """Return a random place (3,) m of a harmless source 0.5 m above the floor beyond the road, map frame."""
    return placed(rng.uniform(57.0, 68.0), rng.uniform(10.0, 70.0), 0.5)


def outline(corners: tuple[tuple[float, float], ...]) -> FloatArray:
    """Return the corners (P, 2) m of an area in the map frame; corners : relative to ORIGIN (m)."""
    return np.array(corners) + ORIGIN[:2]
