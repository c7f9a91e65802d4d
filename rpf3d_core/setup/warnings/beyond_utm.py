"""Find coordinates of a terrain that lie outside every UTM zone: another grid, or feet.

Many metric grids have such coordinates, and many of these coordinates would fit a UTM zone if they were in feet. A
wrong unit changes energies by more than a factor of three. Therefore the sentence to the user first asks for the
coordinate system, and then asks to check the size of the terrain before a unit is set.
"""

import re
from collections.abc import Iterator

import numpy as np

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.setup.coverage import plain
from rpf3d_core.terrain.frame import FloatArray

MOST_EASTING, MOST_NORTHING = 1_000_000.0, 10_000_000.0
"""Coordinates (m) that no easting and no northing of UTM reaches."""
EASTINGS, NORTHINGS = (100_000.0, 900_000.0), (1_000.0, MOST_NORTHING)
"""Ranges of eastings and northings (m) in a UTM zone; a local grid has smaller numbers."""
SWISS = ((2_480_000.0, 2_850_000.0), (1_070_000.0, 1_310_000.0))
"""Ranges of eastings and northings (m) of the Swiss grid LV95, which is common for rockfall."""
FOOT = 0.3048
UTM = re.compile(r"EPSG:32[67]\d\d", re.IGNORECASE)
"""Names of the reference systems WGS84 / UTM."""


def beyond_utm(low: FloatArray, high: FloatArray, relief: float, crs: str | None) -> Iterator[str]:
    """Yield a sentence if a terrain lies outside every UTM zone, and its reference system is UTM or unknown.

    Without a known reference system, coordinates of the Swiss grid give no sentence.

    low, high : (2,) m, corners of the terrain's box in plan; relief : m, height difference of the terrain
    crs : reference system of the terrain, None if unknown
    """
    if crs is not None and not UTM.fullmatch(crs):
        return
    middle = 0.5 * (low + high)
    size = np.abs(middle)
    if (size[0] <= MOST_EASTING and size[1] <= MOST_NORTHING) or (crs is None and _within(middle, SWISS)):
        return
    named = "Name it as `terrain.crs`" if crs is None else f"Name it as `terrain.crs`, in place of {crs}"
    feet = ""
    if _within(size * FOOT, (EASTINGS, NORTHINGS)):
        width = float((high - low).max())
        feet = (
            f". If the coordinates are in feet, the terrain would be {_sized(width * FOOT, relief * FOOT)} instead of "
            f"{_sized(width, relief)}, around {_place(middle * FOOT)}: compare its true size before you set a `unit`"
        )
    yield (
        f"the coordinates of the terrain, around {_place(middle)} m, lie outside every UTM zone, where eastings are "
        f"below 1,000,000 m and northings below 10,000,000 m: which coordinate system is it? {named}{feet}"
    )


def _sized(width: float, relief: float) -> str:
    """Return the larger width (m) of a terrain in plan, and its height difference (m), as text."""
    return f"{three_figures(width)} m wide and {three_figures(relief)} m high"


def _within(place: FloatArray, ranges: tuple[tuple[float, float], tuple[float, float]]) -> bool:
    """Return True if a place (2,) m lies within ranges of both coordinates (m)."""
    return all(begin <= each <= end for each, (begin, end) in zip(place.tolist(), ranges, strict=True))


def _place(place: FloatArray) -> str:
    """Return the coordinates (2,) m of a place as text."""
    return "({})".format(", ".join(plain(round(each)) for each in place.tolist()))
