"""Find the parts of the terrain's rim that hang over other ground: rocks can fly under the terrain there."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.simulation.engines import Compiled, Engine, Reference
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.rim import rim_of

FloatArray = NDArray[np.float64]

LEAST_HEIGHT = 0.1
"""Smallest height (m) of a rim over other ground that is reported; overlapping surveys differ by some centimetres."""
OUTSIDE = 64.0
"""Distance in plan, in crack widths, from a side of the rim to the place where the ground below it is searched."""

MOST_BY_REFERENCE = 100
"""Largest number of sides of the rim that the reference engine searches.

Below a long rim, the reference engine may need 0.1 s for each side.
"""


class HangingRim(NamedTuple):
    """The part of a terrain's rim that hangs over other ground.

    length, whole : m, of this part and of the whole rim; height : m, the largest height over the ground
    place : (3,) m, local frame, where the height is largest
    searched, sides : number of searched sides of the rim, and of all its sides; if `searched` is smaller, only a sample
        of the sides was searched, and `length` is an estimate
    """

    length: float
    whole: float
    height: float
    place: FloatArray
    searched: int
    sides: int


def hanging_rim(terrain: Terrain, engine: Engine) -> HangingRim | None:
    """Return the part of the rim that hangs at least LEAST_HEIGHT (m) over other ground; None if there is none.

    An example is a muck pile whose rim lies above the ground. A side of the rim counts if its middle hangs over ground.
    A rim with more than MOST_BY_REFERENCE sides is searched with the compiled engine. Without numba, only a sample of
    its sides is searched, and `length` is an estimate.

    engine : engine over the terrain, which finds the ground below a place
    """
    rim = rim_of(terrain.triangles, edges_of(terrain.triangles, len(terrain.vertices)))
    begin, end, third = (terrain.vertices[corner] for corner in (rim.begin, rim.end, rim.third))
    if not len(begin):
        return None
    sides = len(begin)
    whole = float(np.linalg.norm(end - begin, axis=1).sum())
    if len(begin) > MOST_BY_REFERENCE and isinstance(engine, Reference):
        if HAS_NUMBA:
            engine = Compiled(facets_of(terrain))
        else:
            some = np.linspace(0, len(begin) - 1, MOST_BY_REFERENCE).astype(int)
            begin, end, third = begin[some], end[some], third[some]
    lengths, middle = np.linalg.norm(end - begin, axis=1), 0.5 * (begin + end)
    outwards = _outwards(begin, end, third)
    below = engine.ground_below(middle + OUTSIDE * float(engine.facets.crack) * outwards)
    heights = np.where((below[:, 1] >= 0) & (below[:, 2] > 0), below[:, 0], 0.0)
    hangs = heights >= LEAST_HEIGHT
    if not hangs.any():
        return None
    most = int(np.argmax(heights))
    return HangingRim(
        length=float(lengths[hangs].sum() / lengths.sum()) * whole,
        whole=whole,
        height=float(heights[most]),
        place=middle[most],
        searched=len(begin),
        sides=sides,
    )


def hanging_rims(terrain: Terrain, engine: Engine) -> Iterator[str]:
    """Yield a warning if a part of the terrain's rim hangs over other ground."""
    found = hanging_rim(terrain, engine)
    if found is not None:
        where = ", ".join(f"{c:.3f}" for c in terrain.frame.points_to_input(found.place))
        about, least, sample = "", "", ""
        if found.searched < found.sides:
            about, least = "about ", "at least "
            sample = f" (from {found.searched:,} of {found.sides:,} sides)"
        length, whole, height = (three_figures(value) for value in (found.length, found.whole, found.height))
        yield (
            f"{about}{length} m of the terrain's rim ({whole} m) hang over other ground{sample}, up to {least}{height} "
            f"m at ({where}): rocks can fly under the terrain there and hit it from behind; extend "
            "that piece of terrain into the ground, or remove it if it is a second survey of the same ground"
        )


def _outwards(begin: FloatArray, end: FloatArray, third: FloatArray) -> FloatArray:
    """Return unit vectors (S, 3) in plan, away from the facet of each side; zero for an upright side."""
    along, inwards = (end - begin)[:, :2], (third - begin)[:, :2]
    across = np.stack([along[:, 1], -along[:, 0]], axis=1)
    length = np.linalg.norm(across, axis=1)
    away = np.where((across * inwards).sum(axis=1) > 0.0, -1.0, 1.0) / np.where(length > 0.0, length, 1.0)
    return np.column_stack([across * away[:, None], np.zeros(len(along))])
