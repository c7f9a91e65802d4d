"""Measure the geometric error of a coarse survey: fly the same rocks over terrains with fewer and fewer triangles."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.decimated import decimated
from rpf3d_core.accuracy.differences import AnswerDifference, difference
from rpf3d_core.accuracy.flown import FlownSample, fly
from rpf3d_core.accuracy.from_above import nearest_ground
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Terrain

PARTS = (2, 4, 8, 16, 32, 64)
"""Divisors of the number of triangles for the coarser terrains: half of the triangles, a quarter, and so on."""
FEWEST = 8
"""Smallest number of triangles of a coarser terrain; results with fewer triangles are useless."""


class Coarser(NamedTuple):
    """The result over a terrain with 1 / `part` of the scene's triangles: its error and its cost.

    triangles : number of triangles; off : difference from the result over the full terrain
    seconds_per_1000 : s of one core for 1,000 rocks
    """

    part: int
    triangles: int
    off: AnswerDifference
    seconds_per_1000: float


def coarser_terrains(prepared: Prepared, releases: Releases, exact: FlownSample) -> Iterator[Coarser]:
    """Yield the error and the cost of each coarser terrain, from 1/2 of the triangles down to 1/64.

    On each terrain, the rocks start at the same heights above the ground. Terrains with fewer than FEWEST (8) triangles
    are left out.

    exact : result of the same releases over the full terrain
    """
    some = taken(releases, exact.rows)
    for part in PARTS:
        if len(prepared.terrain.triangles) < FEWEST * part:
            return
        terrain = decimated(prepared.terrain, 1.0 / part)
        coarse = over_terrain(prepared, terrain, engine_over(prepared.engine.name, terrain))
        found = fly(coarse, put_back(some, prepared.engine, coarse.engine), paths=True)
        yield Coarser(
            part=part,
            triangles=len(terrain.triangles),
            off=difference(found, exact, prepared.scene.gravity),
            seconds_per_1000=found.seconds_per_1000,
        )


def over_terrain(prepared: Prepared, terrain: Terrain, engine: Engine) -> Prepared:
    """Return the scene with another terrain, to fly the scene's rocks there; zones and map cells stay the same.

    terrain : the other terrain; engine : engine over the other terrain
    """
    return replace(prepared, terrain=terrain, engine=engine)


def put_back(releases: Releases, before: Engine, after: Engine) -> Releases:
    """Return the releases moved onto another terrain, so that each rock starts at the same height above the ground.

    The height is measured to the ground straight below. Where the other terrain has no ground, the altitude stays the
    same. If several sheets of ground lie above each other, the sheet nearest in altitude to the old ground is
    used: a rock under an overhang stays under the overhang, and no rock starts under the ground.

    before, after : engines of the old and of the new terrain
    """
    height = before.ground_below(releases.x)[:, 0]
    ground = nearest_ground(after, releases.x, releases.x[:, 2] - height)
    x = np.array(releases.x)
    x[:, 2] = np.where(ground.facet >= 0, ground.z + height, x[:, 2])
    return replace(releases, x=x)
