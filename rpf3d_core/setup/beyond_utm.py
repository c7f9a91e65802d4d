"""Find coordinates of a terrain that lie outside every UTM zone, as if they were in feet."""

import re
from collections.abc import Iterator

import numpy as np

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


def beyond_utm(low: FloatArray, high: FloatArray, crs: str | None) -> Iterator[str]:
    """Yield a sentence if a terrain lies outside every UTM zone, and is in UTM or in an unknown reference system.

    low, high : (2,) m, corners of the terrain's box in plan; crs : its reference system, None if unknown
    """
    if crs is not None and not UTM.fullmatch(crs):
        return
    middle = 0.5 * (low + high)
    size = np.abs(middle)
    if (size[0] <= MOST_EASTING and size[1] <= MOST_NORTHING) or (crs is None and _within(middle, SWISS)):
        return
    is_feet = _within(size * FOOT, (EASTINGS, NORTHINGS))
    feet = (
        f"are they in feet? In metres they would be around {_place(middle * FOOT)}: give its file `unit: ft` (`rpf3d "
        "new`: --unit ft). Or "
    )
    yield (
        f"the coordinates of the terrain, around {_place(middle)} m, lie outside every UTM zone, where eastings are "
        f"below 1,000,000 m and northings below 10,000,000 m: {feet if is_feet else ''}are they in another system? "
        "Name it as `terrain.crs`"
    )


def _within(place: FloatArray, ranges: tuple[tuple[float, float], tuple[float, float]]) -> bool:
    """Return True if a place (2,) m lies within ranges of both coordinates (m)."""
    return all(begin <= each <= end for each, (begin, end) in zip(place.tolist(), ranges, strict=True))


def _place(place: FloatArray) -> str:
    """Return the coordinates (2,) m of a place as text."""
    return "({})".format(", ".join(plain(round(each)) for each in place.tolist()))
